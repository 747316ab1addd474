"""OMPL's RRT as one compiled loop."""

import numpy as np
from numba import types
from numba.core.types import npy_rng
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.motion import GOING, REACHED, draw_control, draw_duration, move
from pbcs_ompl.planners.kernels.nearest import insert, nearest

_matrix = types.float64[:, ::1]


@njit(types.Tuple((types.int64, types.boolean, types.int64))(
    PARAMETERS_TYPE, types.int64[::1], _matrix, types.UniTuple(types.int64, 2), COLUMNS_TYPE, types.int64,
    types.int64, _matrix, types.int32[::1], types.int64, npy_rng), error_model="numpy")
def expand(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, bounds: Array,
           durations: tuple[int, int], columns: Columns, first: int, most: int, box: Array,
           items: NDArray[np.int32], size: int, rng: np.random.Generator) -> tuple[int, bool, int]:
    """Add motions of at most `most` steps together, each from the node nearest to a random feature.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        bounds: Lower and upper bounds of the controls [2, A].
        durations: The least and the most steps of a control.
        columns, first: The tree's arrays, with space for `most` more nodes, and the number of nodes so far.
        most: The most steps, at least the longest duration unless no more are left.
        box: Lower and upper bounds of the features [2, F].
        items, size: The nodes that can be expanded (see `nearest`), with space for `most` more, and their number.
        rng: The random numbers.

    Returns:
        How many nodes were written, whether the last one is the goal, and how many nodes can be expanded.
    """
    parameters, columns = uncounted(parameters), uncounted(columns)
    target, found = np.empty((1, box.shape[1])), np.empty(1, np.int64)
    child, end = first, first + most
    while child == first or child + durations[1] <= end:
        for axis in range(box.shape[1]):
            target[0, axis] = box[0, axis] + (box[1, axis] - box[0, axis]) * rng.random()
        nearest(columns.features, items, size, target, found)
        draw_control(bounds, columns.controls, child, rng)
        steps = min(draw_duration(durations, rng), end - child)
        child, how = move(parameters, feature_dims, columns, found[0], child, steps)
        if how == GOING:
            size = insert(columns.features, items, size, child - 1)
        elif how >= REACHED:
            return child - first, how == REACHED, size
    return child - first, False, size
