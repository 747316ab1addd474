"""Ex as one compiled loop: select, draw a control, step, insert ([Matheron2020] Alg. 5, lines 7 to 12)."""

import numpy as np
from numba import njit, types

from planners.compiled import STEP_TYPE
from planners.kernels.bin_queue import QUEUE_TYPE, insert_one, select_one
from planners.tree import Columns

DONE, GOAL, FULL, NOT_FINITE = range(4)

_matrix = types.float64[:, ::1]
_vector = types.float64[::1]
_integers = types.int64[::1]
COLUMNS_TYPE = types.NamedTuple((_matrix, _matrix, _matrix, types.int32[::1], _vector, types.boolean[::1]), Columns)
"""Numba's type of `planners.tree.Columns`."""


@njit(cache=True)
def _finite(states, row):
    total = 0.0
    for axis in range(states.shape[1]):
        total += states[row, axis] - states[row, axis]
    return total == 0.0


@njit(types.UniTuple(types.int64, 2)(STEP_TYPE, _vector, _matrix, _integers, _integers, _vector, _vector,
                                     COLUMNS_TYPE, types.int64, QUEUE_TYPE, _vector, _matrix), cache=True)
def expand(step, reals, table, integers, feature_dims, low, high, columns, first, queue, bin_size, uniforms):
    """Expand a node for each row of `uniforms` [B, 2 + A] (bin, node, control); write the new nodes from `first` on.

    Returns:
        How many nodes were written, and why the loop ended. Unless DONE, the last of them is not in the
        queue: it is the goal, or the queue was too small for it, or its state is not finite.
    """
    done = 0
    cell = np.empty(len(bin_size), np.int64)
    for row in range(len(uniforms)):
        node = select_one(queue, uniforms[row, 0], uniforms[row, 1])
        child = first + row
        for axis in range(len(low)):
            columns.controls[child, axis] = low[axis] + (high[axis] - low[axis]) * uniforms[row, 2 + axis]
        reward, terminal, success = step(reals, table, integers, columns.states, node, columns.controls, child)
        for axis in range(len(feature_dims)):
            columns.features[child, axis] = columns.states[child, feature_dims[axis]]
        columns.parents[child] = node
        columns.rewards[child] = reward
        columns.terminal[child] = terminal
        done = row + 1
        if not _finite(columns.states, child):
            return done, NOT_FINITE
        if success:
            return done, GOAL
        if not terminal and not insert_one(queue, columns.features, child, bin_size, child, cell):
            return done, FULL
    return done, DONE
