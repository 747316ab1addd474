"""The arrays of a tree, as compiled loops see them."""

from numba import types

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array

_matrix = types.float64[:, ::1]
COLUMNS_TYPE = types.NamedTuple(
    (_matrix, _matrix, _matrix, types.int32[::1], types.float64[::1], types.boolean[::1]), Columns)
"""Numba's type of `pbcs_ompl.core.tree.Columns`."""


@njit()
def finite(states: Array, row: int) -> bool:
    """Return whether all numbers of states[row] are finite."""
    total = 0.0
    for axis in range(states.shape[1]):
        total += states[row, axis] - states[row, axis]
    return total == 0.0
