"""Draw states near a state, as activation sets need them ([Matheron2020] 7.2.4)."""

from collections.abc import Callable

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.types import Array, BoolArray

MAX_ROUNDS = 200


def uniform_in_ball(centre: Array, radius: float, count: int, rng: np.random.Generator) -> Array:
    """Return `count` points [count, D], uniform in the Euclidean ball around `centre` [D]."""
    directions = rng.standard_normal((count, len(centre)))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return centre + radius * rng.random((count, 1)) ** (1.0 / len(centre)) * directions


def valid_in_ball(centre: Array, radius: float, count: int, rng: np.random.Generator,
                  is_valid: Callable[[Array], BoolArray] | None) -> Array:
    """Return `count` points [count, D], uniform in the valid part of the ball, or in all of it.

    Raises:
        InvalidOption: the radius is negative or not finite.
        InvalidState: too few valid points were found in 200 rounds of draws.
    """
    centre = np.asarray(centre, dtype=np.float64)
    if not (np.isfinite(radius) and radius >= 0.0):
        raise InvalidOption(f"radius={radius!r}: expected a finite number >= 0")
    points = uniform_in_ball(centre, radius, count, rng)
    if is_valid is None:
        return points
    bad = np.flatnonzero(~is_valid(points))
    for _ in range(MAX_ROUNDS):
        if not len(bad):
            return points
        points[bad] = uniform_in_ball(centre, radius, len(bad), rng)
        bad = bad[~is_valid(points[bad])]
    if len(bad):
        raise InvalidState(f"no valid state within {radius:g} of {centre.tolist()} in {MAX_ROUNDS} draws")
    return points
