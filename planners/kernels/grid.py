"""Cells and the nodes in each, as OMPL's planners on projections keep them."""

from typing import NamedTuple

import numba
import numpy as np
from numba import types
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, resized_copy
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.kernels.cells import cell_of, find_cell, rehash
from pbcs_ompl.planners.kernels.runs import Members, Number
from pbcs_ompl.planners.kernels.slices import CLASSES, SMALLEST, double, rows_needed, take

CELLS, NODES = 0, 1  # places of `totals`
SLICE = np.dtype([("start", np.int32), ("length", np.int32), ("size", np.int32)])
"""The nodes of a cell: where they begin in the pool, how many there are, log2 of the space."""


class Grid(NamedTuple):
    """The arrays. M rows for cells, F features, R rows of the pool, H hash cells (a power of two)."""

    cells: NDArray[np.int64]
    """Integer coordinates of each cell [M, F]."""
    table: NDArray[np.int32]
    """Hash table of cell numbers plus one, open addressing, 0 for empty [H]."""
    slices: NDArray[np.void]
    """Records of SLICE [M]."""
    pool: Members
    """The nodes of all cells, in slices [R] (see `slices`)."""
    free: NDArray[np.int32]
    used: NDArray[np.int64]
    totals: NDArray[np.int64]
    """Cells and nodes [2]."""
    turns: IndexArray
    """Cells in a period of each feature [F]; 0 for a feature without."""


GRID_TYPE = types.NamedTuple((types.int64[:, ::1], types.int32[::1], numba.from_dtype(SLICE)[::1], types.int32[::1],
                              types.int32[::1], types.int64[::1], types.int64[::1], types.int64[::1]), Grid)
"""Numba's type of Grid."""


def empty_grid(turns: IndexArray) -> Grid:
    """Return a grid without cells, with `turns` [F] cells in a period."""
    cells, rows = 1 << 10, 1 << 14
    return Grid(np.empty((cells, len(turns)), np.int64), np.zeros(4 * cells, np.int32), np.empty(cells, SLICE),
                np.empty(rows, np.int32), np.full(CLASSES, -1, np.int32), np.zeros(2, np.int64),
                np.zeros(2, np.int64), turns)


def reserve(grid: Grid, count: int) -> Grid:
    """Return the grid with space for `count` more nodes; the one that was passed is not to be used any more."""
    known = int(grid.totals[CELLS])
    if known + count > len(grid.cells):
        most = max(GROWTH * len(grid.cells), known + count)
        cells, table = resized_copy(grid.cells, known, most), np.zeros(4 << (most - 1).bit_length(), np.int32)
        rehash(cells, table, known)
        grid = grid._replace(cells=cells, table=table, slices=resized_copy(grid.slices, known, most))
    rows = rows_needed(grid.used, count)
    if rows > len(grid.pool):
        grid = grid._replace(pool=resized_copy(grid.pool, int(grid.used[0]), max(GROWTH * len(grid.pool), rows)))
    return grid


@njit()
def put(grid: Grid, features: Array, node: int, size: Array, cell: NDArray[np.int64]) -> tuple[Number, bool]:
    """Add a node to its cell, whose coordinates are left in `cell` [F]; return the cell, and whether it is new."""
    slices, pool, free, used, totals = grid.slices, grid.pool, grid.free, grid.used, grid.totals
    cell_of(features, node, size, grid.turns, cell)
    place = find_cell(grid.cells, grid.table, cell)
    number = np.int64(grid.table[place]) - 1
    opened = bool(number < 0)
    if opened:
        number = totals[CELLS]
        totals[CELLS] = number + 1
        grid.table[place] = number + 1
        for axis in range(len(cell)):
            grid.cells[number, axis] = cell[axis]
        slices[number].start, slices[number].size = take(pool, free, used, SMALLEST), SMALLEST
        slices[number].length = 0
    length = np.int64(slices[number].length)
    if length == 1 << slices[number].size:
        wide = np.int64(slices[number].size)
        slices[number].start, slices[number].size = double(pool, free, used, slices[number].start, wide), wide + 1
    pool[slices[number].start + length] = node
    slices[number].length = length + 1
    totals[NODES] += 1
    return number, opened
