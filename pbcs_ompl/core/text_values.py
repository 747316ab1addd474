"""JSON and TOML of unknown origin as plain values, within bounds: depth, length, numbers, and each key once."""

import json
import math
import tomllib
from typing import Any

DEEPEST = 60
"""Levels of lists and tables inside each other; ours have less than ten."""
LONGEST_TOML = 4_000_000
"""Characters; a parser in Python takes a second for a million."""
LONGEST_JSON = 200_000_000
MOST_DIGITS = 300
"""Of an integer: longer ones do not fit into a float."""
QUOTED = 200
"""Characters of a value that a message repeats."""


def parse_json(text: str, *, finite: bool = True) -> Any:
    """Return the value of a JSON text.

    Args:
        text: The text.
        finite: Whether NaN and Infinity are refused, which Python writes and JSON does not have.

    Raises:
        ValueError: it is no JSON, too deep or too long, has a key twice, or a number that no float can hold.
    """
    _check_length(text, LONGEST_JSON)
    try:
        value = json.loads(text, object_pairs_hook=_unique, parse_int=_integer, parse_float=_number)
    except RecursionError:
        raise ValueError(f"lists or objects inside each other, more than {DEEPEST} levels deep") from None
    _check_bounds(value, finite)
    return value


def parse_toml(text: str) -> dict[str, Any]:
    """Return the table of a TOML text, which may have numbers that are not finite.

    Raises:
        ValueError: it is no TOML, too deep or too long.
    """
    _check_length(text, LONGEST_TOML)
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise ValueError(f"lists or tables inside each other, more than {DEEPEST} levels deep") from None
    _check_bounds(table, finite=False)
    return table


def shortened(text: str) -> str:
    """Return a text for a message, its middle left out where it is long."""
    return text if len(text) <= QUOTED else f"{text[:QUOTED // 2]} ... {text[-QUOTED // 4:]}"


def _check_length(text: str, longest: int) -> None:
    if len(text) > longest:
        raise ValueError(f"{len(text):,} characters; expected at most {longest:,}")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the key {shortened(next(name for name in names if names.count(name) > 1))!r} is there twice")
    return table


def _integer(digits: str) -> int:
    if len(digits) > MOST_DIGITS:
        raise ValueError(f"an integer of {len(digits):,} digits; expected at most {MOST_DIGITS}")
    return int(digits)


def _number(digits: str) -> float:
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"the number {shortened(digits)} is too large")
    return value


def _check_bounds(value: Any, finite: bool) -> None:
    """Check depth and numbers without recursion; the message has the path of what is wrong, such as rows[2].p."""
    waiting: list[tuple[Any, tuple[Any, ...]]] = [({"": value}, ())]
    while waiting:
        part, path = waiting.pop()
        if len(path) > DEEPEST:
            raise ValueError(f"lists or tables inside each other, more than {DEEPEST} levels deep")
        items = part.items() if isinstance(part, dict) else enumerate(part)
        for key, item in items:
            if isinstance(key, str) and not (key.isascii() or _can_be_encoded(key)):
                raise ValueError(f"a key in {_words(path)} has half a surrogate pair, which is no character")
            kind = type(item)
            if kind is dict or kind is list:
                waiting.append((item, (*path, key)))
            elif kind is float and finite and not math.isfinite(item):
                raise ValueError(f"{_words((*path, key))} is {item}; expected a finite number")
            elif kind is str and not (item.isascii() or _can_be_encoded(item)):
                raise ValueError(f"{_words((*path, key))} has half a surrogate pair, which is no character")
            elif kind is int and item.bit_length() > 1000:
                raise ValueError(f"{_words((*path, key))} has more than {MOST_DIGITS} digits")


def _can_be_encoded(text: str) -> bool:
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


def _words(path: tuple[Any, ...]) -> str:
    parts = (f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return shortened("".join(parts).lstrip(".") or "the value")
