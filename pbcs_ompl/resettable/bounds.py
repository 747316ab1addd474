"""Bounds in float32, as most spaces have them, mean the numbers that they were rounded from."""

from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array


def widened(bounds: Any, direction: float) -> Array:
    """Return bounds in float64 that admit every number which rounds to the given ones.

    A Box that is declared with the bound 0.7 has 0.699999988 in float32; a state of 0.7 is inside all the same. Bounds
    of a shorter float are moved outwards by half the distance to the next number of their type; so are those in float64
    that were evidently taken from float32, as 0.699999988079071 and unlike 0.5 or 0.7.

    Args:
        bounds: Numbers of any type.
        direction: -inf for lower bounds, inf for upper ones.
    """
    given = np.asarray(bounds)
    exact = given.astype(np.float64)
    short = given if given.dtype in (np.float16, np.float32) else given.astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        following = np.nextafter(short, np.asarray(direction, short.dtype)).astype(np.float64)
        outwards = exact + (following - exact) / 2.0
    rounded = given.dtype == short.dtype or _taken_from_float32(exact, short)
    chosen: Array = np.where(np.isfinite(outwards) & rounded, outwards, exact)
    return chosen


def _taken_from_float32(exact: Array, short: Any) -> Any:
    """Return which numbers are those of float32 but not the decimal number that float32 prints for them."""
    decimal = np.array([float(str(value)) for value in short.ravel()]).reshape(short.shape)
    return (short.astype(np.float64) == exact) & (decimal != exact)
