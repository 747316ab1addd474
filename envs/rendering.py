"""Pictures of a point or a body in a square world, drawn with NumPy alone: no display, the same pixels everywhere."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.types import Array

PIXELS = 480
FLOOR, WALL, GOAL, POINT = (255, 255, 255), (40, 40, 46), (120, 200, 120), (205, 50, 50)
FRONT = (110, 20, 20)


class OrientedBox(NamedTuple):
    """A rectangle: its centre, its angle, and half of its edges along the angle and across."""

    x: float
    y: float
    angle: float
    half_length: float
    half_width: float


def rasterise(extent: float, walls: Array, goal_circle: tuple[float, float, float] | None,
              moving: Array | OrientedBox, ground: tuple[float, float, float] | None = None) -> NDArray[np.uint8]:
    """Return the world [0, extent]^2 as an image [480, 480, 3], y upwards.

    Args:
        extent: Edge length of the world.
        walls: Rectangles [W, 4].
        goal_circle: Centre and radius of the goal.
        moving: Position [2] of a point, drawn at least 3 pixels wide; or a box, the first quarter of which is darker.
        ground: Circle outside of which the ground is drawn as wall.
    """
    axis = (np.arange(PIXELS) + 0.5) * (extent / PIXELS)
    image = np.full((PIXELS, PIXELS, 3), FLOOR, dtype=np.uint8)
    if ground is not None:
        image[~_disc(axis, *ground)] = WALL
    if goal_circle is not None:
        image[_disc(axis, *goal_circle)] = GOAL
    for x0, y0, x1, y1 in walls:
        columns, rows = np.searchsorted(axis, [x0, x1]), np.searchsorted(axis, [y0, y1])
        image[slice(*rows), slice(*columns)] = WALL
    if isinstance(moving, OrientedBox):
        inside, front = _box(axis, moving)
        image[inside], image[inside & front] = POINT, FRONT
    else:
        image[_disc(axis, moving[0], moving[1], max(0.06, 2.0 * extent / PIXELS))] = POINT
    return image[::-1].copy()


def _disc(axis: NDArray[np.floating], x: float, y: float, radius: float) -> NDArray[np.bool_]:
    """Return the pixels [row, column] inside of a circle."""
    return (axis[None, :] - x) ** 2 + (axis[:, None] - y) ** 2 < radius**2


def _box(axis: NDArray[np.floating], box: OrientedBox) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the pixels [row, column] inside of a rectangle, and those in front of its last quarter."""
    dx, dy = axis[None, :] - box.x, axis[:, None] - box.y
    along, across = dx * np.cos(box.angle) + dy * np.sin(box.angle), dy * np.cos(box.angle) - dx * np.sin(box.angle)
    return (np.abs(along) < box.half_length) & (np.abs(across) < box.half_width), along > box.half_length / 2
