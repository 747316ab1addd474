"""The checks of what a user gives: names and ranges, each with one message."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from pbcs_ompl.core.checked import short_repr
from pbcs_ompl.core.errors import InvalidOption, did_you_mean
from pbcs_ompl.core.types import Array

MOST_STEPS = 10**6
"""What a control lasts at most."""


def check_names(owner: str, kind: str, given: Collection[str], known: Collection[str]) -> None:
    """Refuse names that do not exist.

    Args:
        owner: What has the options, as in "planner 'Ex'".
        kind: What is named: "option", "setting".
        given: The names that were given.
        known: The names that exist.

    Raises:
        InvalidOption: one does not exist; the closest is suggested.
    """
    for name in given:
        if name not in known:
            hint = did_you_mean(name, known) or f"; it takes no {kind}s"
            raise InvalidOption(f"{owner} has no {kind} {name!r}{hint}")


def check_range(name: str, value: Any, holds: bool, expected: str) -> None:
    """Refuse a value outside of its range.

    Args:
        name: The option.
        value: What was given.
        holds: Whether it is allowed.
        expected: The range in words, such as "at least 1" or "within [0, 1]".

    Raises:
        InvalidOption: it is not allowed.
    """
    if not holds:
        raise InvalidOption(f"{name} is {short_repr(value)}; expected {expected}")


def check_types(values: Mapping[str, Any], types: Mapping[str, type]) -> None:
    """Refuse values of another type than that of their names; integers serve as floats, booleans as neither.

    Args:
        values: What was given, by name.
        types: The type that each name wants.

    Raises:
        InvalidOption: a value has another type.
    """
    for name, value in values.items():
        wanted = types[name]
        allowed = (int, float) if wanted is float else wanted
        if not isinstance(value, allowed) or (isinstance(value, bool) and wanted is not bool):
            raise InvalidOption(f"{name} is {value!r}; expected {wanted.__name__}")


def check_positive_integer(name: str, value: Any) -> int:
    """Return `value`.

    Raises:
        InvalidOption: it is not an integer above 0.
    """
    check_range(name, value, isinstance(value, int) and not isinstance(value, bool) and value > 0,
                "an integer above 0")
    return int(value)


def check_control_duration(value: Any) -> tuple[int, int]:
    """Return the least and the most steps of a control: 1 and the value, or the two numbers of a sequence.

    Raises:
        InvalidOption: neither an integer above 0 nor two of them, the smaller one first.
    """
    both = value if isinstance(value, list | tuple) else (1, value)
    integers = all(isinstance(steps, int) and not isinstance(steps, bool) for steps in both)
    check_range("control_duration", value, integers and len(both) == 2 and 0 < both[0] <= both[1] <= MOST_STEPS,
                f"an integer from 1 to {MOST_STEPS}, or two, the least steps of a control and the most")
    return both[0], both[1]


def check_positive_numbers(name: str, value: Any) -> Array:
    """Return a number, or a list of some, as an array [K].

    Raises:
        InvalidOption: one of them is not a finite number above 0.
    """
    try:
        numbers = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        numbers = np.zeros(1)
    check_range(name, value, numbers.ndim == 1 and bool((np.isfinite(numbers) & (numbers > 0)).all()),
                "finite numbers above 0")
    return numbers
