"""A hash table of cells: integer coordinates of bins to their numbers, open addressing, 0 for an empty place.

The hash is linear in the coordinates up to its last step, so that the hash of a neighbour is one addition away.
"""

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array
from pbcs_ompl.planners.kernels.runs import Number

FARTHEST = 4.6e18  # cells beyond this coordinate are one cell: int64 ends there
WEIGHT = np.uint64(0x9E3779B97F4A7C15)


@njit(inline="always", error_model="numpy")
def cell_of(features: Array, row: Number, size: Array, cell: NDArray[np.int64]) -> None:
    """Write the coordinates floor(feature / size) of features[row] into the first F of `cell`."""
    for axis in range(len(size)):
        cell[axis] = int(min(max(np.floor(features[row, axis] / size[axis]), -FARTHEST), FARTHEST))


@njit(inline="always")
def linear_hash(cell: NDArray[np.int64]) -> np.uint64:
    """Return the sum of cell[axis] WEIGHT**(axis + 1), modulo 2**64."""
    mixed, weight = np.uint64(0), WEIGHT
    for axis in range(len(cell)):
        mixed += np.uint64(cell[axis]) * weight
        weight *= WEIGHT
    return mixed


@njit(inline="always")
def find_hashed(cells: NDArray[np.int64], table: NDArray[np.int32], cell: NDArray[np.int64],
                mixed: np.uint64) -> Number:
    """Return the position in `table` of a cell with this linear hash, or of the empty place where it belongs."""
    mixed = (mixed ^ (mixed >> np.uint64(32))) * WEIGHT
    place = np.int64((mixed >> np.uint64(32)) & np.uint64(len(table) - 1))
    while table[place] > 0:
        same = True
        for axis in range(len(cell)):
            same = same and cells[table[place] - 1, axis] == cell[axis]
        if same:
            return place
        place = (place + 1) & (len(table) - 1)
    return place


@njit(inline="always")
def find_cell(cells: NDArray[np.int64], table: NDArray[np.int32], cell: NDArray[np.int64]) -> Number:
    """Return the position in `table` of a cell, or of the empty place where it belongs."""
    return find_hashed(cells, table, cell, linear_hash(cell))


@njit()
def rehash(cells: NDArray[np.int64], table: NDArray[np.int32], bins: int) -> None:
    """Put the first `bins` cells into an empty table."""
    for number in range(bins):
        table[find_cell(cells, table, cells[number])] = number + 1
