"""A hash table of cells: integer coordinates of bins to their numbers, open addressing, 0 for an empty place."""

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.kernels.runs import Number

FARTHEST = 4.6e18  # cells beyond this coordinate are one cell: int64 ends there
WEIGHT = np.uint64(0x9E3779B97F4A7C15)
PROBE = 17
"""How far to the next place where one is taken: odd, so that all are tried, and in the next line of the cache."""


@njit(inline="always", error_model="numpy")
def cell_of(features: Array, row: Number, size: Array, turns: IndexArray, cell: NDArray[np.int64]) -> None:
    """Write the coordinates floor(feature / size) of features[row] into the first F of `cell`.

    Of a feature with a period they are taken modulo the cells of a period, which is what `turns` [F] has; 0 for others.
    """
    for axis in range(len(size)):
        cell[axis] = int(min(max(np.floor(features[row, axis] / size[axis]), -FARTHEST), FARTHEST))
        if turns[axis] > 0:
            cell[axis] %= turns[axis]


@njit(inline="always")
def step_aside(cell: NDArray[np.int64], axis: int, side: int, turns: IndexArray, scale: Number) -> Number:
    """Move `cell` to its neighbour along an axis, at a scale of 2**scale cells; return where it was.

    A cell is its own neighbour where it is the only one of a period.
    """
    before: Number = np.int64(cell[axis])
    cell[axis] += side
    if turns[axis] > 0:
        cell[axis] %= ((turns[axis] - 1) >> scale) + 1
    return before


@njit(inline="always")
def find_cell(cells: NDArray[np.int64], table: NDArray[np.int32], cell: NDArray[np.int64]) -> Number:
    """Return the position in `table` of a cell, or of the empty place where it belongs.

    Cells that agree in all but the last two bits of their first two coordinates lie within 16 places, a line of the
    cache: most neighbours of a cell are found where it is.
    """
    mixed, weight = np.uint64(0), WEIGHT
    for axis in range(len(cell)):
        block = cell[axis] >> 2 if axis < 2 else cell[axis]
        mixed += np.uint64(block) * weight
        weight *= WEIGHT
    mixed = (mixed ^ (mixed >> np.uint64(32))) * WEIGHT
    within = cell[0] & 3
    if len(cell) > 1:
        within |= (cell[1] & 3) << 2
    hashed = np.int64(mixed >> np.uint64(28)) ^ within
    place: Number = hashed & (len(table) - 1)
    while table[place] > 0:
        same = True
        for axis in range(len(cell)):
            same = same and cells[table[place] - 1, axis] == cell[axis]
        if same:
            return place
        place = (place + PROBE) & (len(table) - 1)
    return place


@njit()
def rehash(cells: NDArray[np.int64], table: NDArray[np.int32], bins: int) -> None:
    """Put the first `bins` cells into an empty table."""
    for number in range(bins):
        table[find_cell(cells, table, cells[number])] = number + 1
