"""A rectangle at any angle among walls: does it touch one? Compiled, for bodies that turn."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, BoolArray

MARGIN = 1e-6
"""What comes closer to a wall than this counts as a hit, so that FCL finds no overlap where the kernel found none."""


@njit()
def wrapped(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    turned: float = angle - 2.0 * np.pi * np.floor((angle + np.pi) / (2.0 * np.pi))
    return turned if turned < np.pi else -np.pi


@njit()
def touches(walls: Array, extent: float, x: float, y: float, angle: float, half_x: float, half_y: float) -> bool:
    """Return whether a rectangle touches a wall or the border of [0, extent]^2.

    Separating axes: two closed rectangles are apart if and only if their projections on one of the four directions of
    their edges are.

    Args:
        walls: Rectangles [W, 4] (x0, y0, x1, y1).
        extent: Edge length of the world.
        x, y: The centre.
        angle: From the x axis to the edge of length 2 half_x.
        half_x, half_y: Half of its edges.
    """
    c, s = np.cos(angle), np.sin(angle)
    half_x, half_y = half_x + MARGIN, half_y + MARGIN
    reach_x, reach_y = half_x * abs(c) + half_y * abs(s), half_x * abs(s) + half_y * abs(c)
    if not (reach_x <= x <= extent - reach_x and reach_y <= y <= extent - reach_y):
        return True
    for k in range(walls.shape[0]):
        wide, high = (walls[k, 2] - walls[k, 0]) / 2.0, (walls[k, 3] - walls[k, 1]) / 2.0
        dx, dy = (walls[k, 0] + walls[k, 2]) / 2.0 - x, (walls[k, 1] + walls[k, 3]) / 2.0 - y
        if (abs(dx) <= wide + reach_x and abs(dy) <= high + reach_y
                and abs(dx * c + dy * s) <= half_x + wide * abs(c) + high * abs(s)
                and abs(dy * c - dx * s) <= half_y + wide * abs(s) + high * abs(c)):
            return True
    return False


@njit()
def touching(walls: Array, extent: float, poses: Array, half_x: float, half_y: float) -> BoolArray:
    """Return which rectangles with the poses [B, 3] (x, y, angle) touch a wall or the border [B]; see `touches`."""
    hits = np.empty(poses.shape[0], dtype=np.bool_)
    for k in range(poses.shape[0]):
        hits[k] = touches(walls, extent, poses[k, 0], poses[k, 1], poses[k, 2], half_x, half_y)
    return hits
