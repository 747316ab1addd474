"""How the words after an option become values. Each raises argparse's own error, which names the option."""

from argparse import ArgumentTypeError
from collections.abc import Callable, Iterable
from math import isfinite
from typing import Any

from pbcs_ompl.core.errors import did_you_mean
from pbcs_ompl.core.text_values import parse_json, shortened
from pbcs_ompl.core.utf8 import joined

EXPECTED_OBJECT = "expected a JSON object such as '{\"size\": 5}'"
EXPECTED_OBJECTS = "expected a JSON list of objects such as '[{\"size\": 4}, {\"size\": 5}]'"


def integer(low: int) -> Callable[[str], int]:
    """Return a reader of whole numbers of at least `low`; 200000, 200_000 and 2e5 are the same."""

    def read(text: str) -> int:
        value = _number(text)
        if not isfinite(value) or value != int(value) or value < low:
            raise ArgumentTypeError(f"expected a whole number of at least {low}, got {text!r}")
        return int(text) if text.lstrip("+").replace("_", "").isdigit() else int(value)

    return read


def seconds(text: str) -> float:
    """Read a positive number of seconds."""
    value = _number(text)
    if not (isfinite(value) and value > 0):
        raise ArgumentTypeError(f"expected a positive number of seconds, got {text!r}")
    return value


def amount(text: str) -> int | str:
    """Read transitions as 5000, a share as 10%, or seconds as 2s."""
    if text[-1:] not in ("%", "s"):
        return integer(1)(text)
    value = _number(text[:-1])
    if not (isfinite(value) and value > 0):
        raise ArgumentTypeError(f"expected transitions as 5000, a share as 10%, or seconds as 2s, got {text!r}")
    return text


def fraction(text: str) -> float:
    """Read a number from 0 to 1."""
    value = _number(text)
    if not 0 <= value <= 1:
        raise ArgumentTypeError(f"expected a number from 0 to 1, got {text!r}")
    return value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


class Choice:
    """A reader of one of `names`; the closest is suggested for any other word."""

    def __init__(self, kind: str, names: Iterable[str]):
        self.kind, self.names = kind, tuple(names)

    def __call__(self, text: str) -> str:
        """Read one of the names."""
        if text not in self.names:
            raise ArgumentTypeError(f"unknown {self.kind} {text!r}{did_you_mean(text, self.names)}")
        return text


def part(text: str) -> tuple[int, int]:
    """Read a part of a whole, as 2/3."""
    index, slash, count = text.partition("/")
    if not (slash and index.isdecimal() and count.isdecimal()):
        raise ArgumentTypeError(f"expected a part such as 2/3, got {text!r}")
    return int(index), int(count)


def json_objects(text: str) -> list[dict[str, Any]]:
    """Read a JSON list of objects."""
    try:
        values = parse_json(joined(text))
    except ValueError as error:
        raise ArgumentTypeError(f"{EXPECTED_OBJECTS}, got {shortened(text)!r}: {error}") from error
    if not isinstance(values, list) or not values or not all(isinstance(value, dict) for value in values):
        raise ArgumentTypeError(f"{EXPECTED_OBJECTS}, got {shortened(text)!r}")
    return values


def json_object(text: str) -> dict[str, Any]:
    """Read a JSON object."""
    try:
        value = parse_json(joined(text))
    except ValueError as error:
        raise ArgumentTypeError(f"{EXPECTED_OBJECT}, got {shortened(text)!r}: {error}") from error
    if not isinstance(value, dict):
        raise ArgumentTypeError(f"{EXPECTED_OBJECT}, got {shortened(text)!r}")
    return value
