"""Which walls are near a point: a uniform grid over the square world, so that a step tests few walls."""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.core.types import Array, IndexArray

CELLS_PER_UNIT = 5
MARGIN = 1e-6
"""Widens the reach of a grid cell, so that rounding in the cell lookup cannot lose a wall."""


class WallGrid(NamedTuple):
    """Walls by grid cell, in compressed rows: near cell c are the walls `lists[lists[c]:lists[c + 1]]`."""

    rectangles: Array
    """Walls [W, 4]."""
    lists: IndexArray
    """Where the walls of each cell begin in this same array [C * C + 1], then the numbers of the walls, cell
    after cell. Cell (i, j) is number i * C + j."""
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
    near = [(i * cells + j, wall) for wall, (i0, j0, i1, j1) in enumerate(ranges.tolist())
            for i in range(i0, i1 + 1) for j in range(j0, j1 + 1)]
    pairs = np.array(sorted(near), dtype=np.int64).reshape(-1, 2)
    counts = np.bincount(pairs[:, 0], minlength=cells * cells)
    begins = np.cumsum([cells * cells + 1, *counts])
    return WallGrid(np.array(rectangles), np.concatenate([begins, pairs[:, 1]]), cells)
