"""A point in the plane as a `Robot`: it has no heading, and one side."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.robot import Symmetry
from pbcs_ompl.core.types import Array, BoolArray


@dataclass(frozen=True, eq=False)
class PointRobot:
    """State and observation are its place (x, y); so is all that a follower sees of it, and nothing is left."""

    place: tuple[int, int] = (0, 1)
    turning: float = 0.0
    symmetries: tuple[Symmetry, ...] = (Symmetry.identity(2, 2),)

    def heading(self, observations: Array) -> Array:
        """Return zeros [B]."""
        return np.zeros(len(observations))

    def fallen(self, observations: Array) -> BoolArray:
        """Return that none has fallen [B]."""
        return np.zeros(len(observations), dtype=np.bool_)

    def turned(self, observations: Array, angles: Array) -> Array:
        """Return places [B, 2] turned by angles [B] about the origin."""
        c, s = np.cos(angles), np.sin(angles)
        x, y = observations.T
        return np.stack([c * x - s * y, s * x + c * y], axis=1)

    def put(self, states: Array, places: Array, angles: Array) -> Array:
        """Return a copy of `places`."""
        return places.copy()
