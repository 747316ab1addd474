"""The language of goals and features: what a line of text selects and compares.

    goal     = condition { "and" condition }
    feature  = values { "," values }
    condition = values OP NUMBER                    OP is one of >, >=, <, <=
    values   = part | "|" part "|"                  bars: absolute values
    part     = SOURCE { "[" KEY "]" } [ "[" selection "]" ]       keys: of info only
    selection = INDEX | [INDEX] ":" [INDEX]         as in Python; negative ones count from the end
"""

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pbcs_ompl.core.errors import InvalidOption, did_you_mean
from pbcs_ompl.core.types import Array

WORDS = ("obs", "qpos", "qvel", "state", "achieved_goal", "desired_goal", "reward", "terminated", "success", "info")
"""The sources of numbers."""
COMPARISONS: dict[str, Callable[[Any, float], Any]] = {
    ">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
PART = re.compile(r"\s*(\w+)\s*((?:\[[^\[\]]*\]\s*)*)")
BRACKETS = re.compile(r"\[([^\[\]]*)\]")
SELECTION = re.compile(r"\s*(-?\d+)?\s*(:?)\s*(-?\d+)?\s*")
JOINED = re.compile(r"\s+and\s+")


@dataclass(frozen=True)
class Values:
    """Numbers that a rule selects.

    Attributes:
        source: One of `WORDS`.
        keys: Those of `info`, the outermost first.
        part: Which of the numbers of the source.
        absolute: Whether signs are dropped.
    """

    source: str
    keys: tuple[str, ...]
    part: slice
    absolute: bool

    @property
    def name(self) -> str:
        """What the selection is made from, as info[distance]."""
        return self.source + "".join(f"[{key}]" for key in self.keys)

    def fits(self, size: int) -> bool:
        """Return whether the selection lies within `size` numbers and is not empty."""
        start, stop = self.part.start or 0, self.part.stop
        return bool(range(size)[self.part]) and start >= -size and (stop is None or -size <= stop <= size)


@dataclass(frozen=True)
class Condition:
    """A comparison that all of the selected numbers have to fulfil."""

    values: Values
    compare: Callable[[Any, float], Any]
    limit: float

    def holds(self, numbers: Array) -> bool:
        """Return whether it holds for the numbers [N] that `values` selects."""
        return bool(self.compare(numbers, self.limit).all())


def parse_conditions(rule: str, example: str) -> list[Condition]:
    """Return the conditions of a goal.

    Args:
        rule: The text.
        example: What a right one looks like, for messages.

    Raises:
        InvalidOption: the text does not parse.
    """
    return [_condition(rule, text, example) for text in JOINED.split(rule)]


def parse_values(rule: str, example: str) -> list[Values]:
    """Return the parts of a feature; the arguments are those of `parse_conditions`.

    Raises:
        InvalidOption: the text does not parse.
    """
    return [_values("feature", rule, text, example) for text in rule.split(",")]


def _condition(rule: str, text: str, example: str) -> Condition:
    for symbol in ("==", "!="):
        if symbol in text:
            raise InvalidOption(f"goal rule {rule!r}: there is no {symbol}, since real numbers are hardly ever exactly "
                                f"equal; say how near, such as '|obs[0]|<0.1' or 'obs[0]>0.9 and obs[0]<1.1', and "
                                f"'success>0' or 'success<1' of flags")
    for symbol, compare in COMPARISONS.items():
        left, found, right = text.partition(symbol)
        if found:
            return Condition(_values("goal", rule, left, example), compare, _number(rule, right))
    raise InvalidOption(f"goal rule {rule!r} compares nothing; expected something like {example}")


def _values(kind: str, rule: str, text: str, example: str) -> Values:
    bare = text.strip()
    absolute = len(bare) > 1 and bare.startswith("|") and bare.endswith("|")
    match = PART.fullmatch(bare[1:-1] if absolute else bare)
    if match is None:
        raise _unread(kind, rule, bare, example)
    name, inside = match[1], [word.strip() for word in BRACKETS.findall(match[2])]
    if name not in WORDS:
        raise InvalidOption(f"{kind} rule {rule!r}: unknown source {name!r}{did_you_mean(name, WORDS)}")
    keys = _keys(inside) if name == "info" else ()
    if len(inside) > len(keys) + 1 or (name == "info" and not keys):
        raise _unread(kind, rule, bare, example)
    return Values(name, tuple(keys), _selection(kind, rule, inside[len(keys):], example), absolute)


def _keys(inside: list[str]) -> list[str]:
    """Return the brackets of `info` that hold keys: all, but the last where it is a selection."""
    last_selects = len(inside) > 1 and SELECTION.fullmatch(inside[-1]) is not None
    return [word.strip("'\"") for word in (inside[:-1] if last_selects else inside)]


def _selection(kind: str, rule: str, inside: list[str], example: str) -> slice:
    if not inside:
        return slice(None)
    match = SELECTION.fullmatch(inside[0])
    if match is None:
        raise _unread(kind, rule, f"[{inside[0]}]", example)
    first, colon, last = match.groups()
    start, stop = (None if number is None else int(number) for number in (first, last))
    if colon:
        return slice(start, stop)
    return slice(None) if start is None else slice(start, None if start == -1 else start + 1)


def _unread(kind: str, rule: str, text: str, example: str) -> InvalidOption:
    return InvalidOption(f"{kind} rule {rule!r} does not parse at {text!r}; expected something like {example}")


def _number(rule: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError as error:
        raise InvalidOption(f"goal rule {rule!r}: expected a number after the comparison, got {text!r}") from error
    if not math.isfinite(number):
        raise InvalidOption(f"goal rule {rule!r}: {text.strip()} is no finite number; expected something like "
                            f"'reward>0'")
    return number
