"""A MuJoCo robot whose root is a free joint, as a `Robot`: it looks where the x axis of its root points."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.robot import Symmetry
from pbcs_ompl.core.types import Array, BoolArray

FALLEN = 0.5
"""Below this cosine of the angle between the z axis of its root and the vertical a robot has fallen (ours)."""


@dataclass(frozen=True, eq=False)
class FreeRobot:
    """The observation is [qpos | qvel], the state [time | qpos | qvel]; the free joint comes first in both.

    Attributes:
        num_positions: Length of qpos.
        symmetries: See `Robot`.
    """

    num_positions: int
    symmetries: tuple[Symmetry, ...]
    place: tuple[int, int] = (0, 1)
    turning: float = 0.0

    def heading(self, observations: Array) -> Array:
        """Return the yaw [B] of the root."""
        w, x, y, z = observations[:, 3:7].T
        yaw: Array = np.arctan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)  # resets give no unit quaternions
        return yaw

    def fallen(self, observations: Array) -> BoolArray:
        """Return which robots lean by more than 60 degrees [B]."""
        w, x, y, z = np.square(observations[:, 3:7]).T
        leaning: BoolArray = w + z - x - y < FALLEN * (w + x + y + z)
        return leaning

    def turned(self, observations: Array, angles: Array) -> Array:
        """Return observations [B, O] in a world that is turned; quaternions have w >= 0."""
        whole = observations.copy()
        _turn(whole, angles, 0, self.num_positions)
        whole[:, 0:2] = rotated(whole[:, 0:2], angles)
        return whole

    def put(self, states: Array, places: Array, angles: Array) -> Array:
        """Return states [B, D] at places [B, 2], turned by angles [B] about the vertical."""
        whole = states.copy()
        _turn(whole, angles, 1, 1 + self.num_positions)
        whole[:, 1:3] = places
        return whole


def _turn(rows: Array, angles: Array, positions: int, speeds: int) -> None:
    """Turn the orientation and the speed of the root; its turning rate is in its own frame, and stays."""
    turned = product(about_vertical(angles), rows[:, positions + 3:positions + 7])
    rows[:, positions + 3:positions + 7] = turned * np.where(turned[:, :1] < 0, -1.0, 1.0)
    rows[:, speeds:speeds + 2] = rotated(rows[:, speeds:speeds + 2], angles)


def rotated(vectors: Array, angles: Array) -> Array:
    """Return vectors [B, 2] turned by angles [B]."""
    c, s = np.cos(angles), np.sin(angles)
    x, y = vectors.T
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def about_vertical(angles: Array) -> Array:
    """Return the quaternions (w, x, y, z) [B, 4] of turns about the z axis."""
    zero = np.zeros_like(angles)
    return np.stack([np.cos(angles / 2), zero, zero, np.sin(angles / 2)], axis=1)


def product(first: Array, second: Array) -> Array:
    """Return Hamilton's products of quaternions (w, x, y, z) [B, 4]."""
    w, x, y, z = first.T
    a, b, c, d = second.T
    return np.stack([w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c,
                     w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a], axis=1)
