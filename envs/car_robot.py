"""A car in the plane as a `Robot`: it looks where it drives, and lines say where it has to look."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.robot import Symmetry
from pbcs_ompl.core.types import Array, BoolArray


@dataclass(frozen=True, eq=False)
class CarRobot:
    """The state is (x, y, heading, speed); the observation is the state, then the cosine and the sine of the heading.

    Attributes:
        turning: See `Robot`.
    """

    turning: float
    place: tuple[int, int] = (0, 1)
    symmetries: tuple[Symmetry, ...] = (Symmetry.identity(6, 2),)

    def heading(self, observations: Array) -> Array:
        """Return the headings [B]."""
        headings: Array = observations[:, 2]
        return headings

    def fallen(self, observations: Array) -> BoolArray:
        """Return that none has fallen [B]."""
        return np.zeros(len(observations), dtype=np.bool_)

    def turned(self, observations: Array, angles: Array) -> Array:
        """Return observations [B, 6] in a world that is turned."""
        c, s = np.cos(angles), np.sin(angles)
        x, y, heading, speed = observations[:, :4].T
        heading = wrapped(heading + angles)
        return np.stack([c * x - s * y, s * x + c * y, heading, speed, np.cos(heading), np.sin(heading)], axis=1)

    def put(self, states: Array, places: Array, angles: Array) -> Array:
        """Return states [B, 4] at places [B, 2], turned by angles [B]."""
        moved = states.copy()
        moved[:, :2], moved[:, 2] = places, wrapped(states[:, 2] + angles)
        return moved


def wrapped(angles: Array) -> Array:
    """Return angles in [-pi, pi)."""
    return (angles + np.pi) % (2.0 * np.pi) - np.pi
