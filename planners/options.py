"""Options of planners, checked by name."""

import inspect
from collections.abc import Collection
from typing import Any

from pbcs_ompl.core.errors import InvalidOption, did_you_mean


def check_names(planner: str, options: Collection[str], known: Collection[str]) -> None:
    """Refuse an option that does not exist.

    Raises:
        InvalidOption: names the closest one that does.
    """
    for option in options:
        if option not in known:
            hint = did_you_mean(option, known) or "; it takes none"
            raise InvalidOption(f"planner {planner!r} has no option {option!r}{hint}")


def keywords(recipe: Any) -> list[str]:
    """Return the names of the arguments that a callable takes."""
    return list(inspect.signature(recipe).parameters)


def positive(name: str, value: float) -> float:
    """Return `value` as a float.

    Raises:
        InvalidOption: it is not a finite number above 0.
    """
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InvalidOption(f"{name}={value!r}: expected a number above 0") from error
    if not 0 < number < float("inf"):
        raise InvalidOption(f"{name}={value!r}: expected a finite number above 0")
    return number


def positive_integer(name: str, value: Any) -> int:
    """Return `value` as an int.

    Raises:
        InvalidOption: it is not an integer above 0.
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InvalidOption(f"{name}={value!r}: expected an integer above 0")
    return value
