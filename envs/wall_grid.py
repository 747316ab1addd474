"""Which walls are near a point: a uniform grid over the square world, so that a step tests few walls."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.contracts import Array

CELLS_PER_UNIT = 5
MARGIN = 1e-6
"""Widens the reach of a grid cell, so that rounding in the cell lookup cannot lose a wall."""


class WallGrid(NamedTuple):
    """Walls by grid cell, in compressed rows: cell c is near the walls `nearby[first[c]:first[c + 1]]`."""

    rectangles: Array
    """Walls [W, 4]."""
    first: NDArray[np.int32]
    """Where the walls of each cell begin [C * C + 1]; cell (i, j) is number i * C + j."""
    nearby: NDArray[np.int32]
    """Numbers of walls, cell after cell."""
    cells: int
    """Number C of cells along each axis."""


def build_wall_grid(rectangles: Array, extent: float, reach: float) -> WallGrid:
    """List for each cell of [0, extent]^2 the walls that a segment from within it can touch.

    Args:
        rectangles: Walls [W, 4] (x0, y0, x1, y1).
        extent: Edge length of the world.
        reach: The longest step along each axis.
    """
    cells = max(1, int(np.ceil(extent * CELLS_PER_UNIT)))
    spread = np.array([-1.0, -1.0, 1.0, 1.0]) * (reach + MARGIN)
    ranges = np.floor((rectangles + spread) * CELLS_PER_UNIT).astype(np.int64).clip(0, cells - 1)
    near: list[list[int]] = [[] for _ in range(cells * cells)]
    for wall, (i0, j0, i1, j1) in enumerate(ranges.tolist()):
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                near[i * cells + j].append(wall)
    first = np.zeros(cells * cells + 1, dtype=np.int32)
    np.cumsum([len(walls) for walls in near], out=first[1:])
    nearby = np.array([wall for walls in near for wall in walls], dtype=np.int32)
    return WallGrid(np.ascontiguousarray(rectangles), first, nearby, cells)
