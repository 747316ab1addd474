"""Ex as one compiled loop: select, draw a control, step, insert ([Matheron2020] Alg. 5, lines 7 to 12)."""

import numpy as np
from numba import types

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import call_step
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.bin_queue import QUEUE_TYPE, BinQueue, add, grow_and_add
from pbcs_ompl.planners.kernels.cells import cell_of, find_cell
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE, finite
from pbcs_ompl.planners.kernels.memory import prefetch, uncounted
from pbcs_ompl.planners.kernels.runs import Heads, Members, choose, peek

_matrix = types.float64[:, ::1]
_vector = types.float64[::1]
_integers = types.int64[::1]
AHEAD = 16
"""Rows that are looked at in advance; a power of two."""
LARGE = 1 << 19
"""Nodes from which on the tree is larger than the cache, so that it pays."""


@njit(inline="always")
def _fetch(row: int, uniforms: Array, ahead: IndexArray, order: Members, head: Heads, heads: Heads, pool: Members,
           states: Array) -> None:
    """Fetch memory that rows to come will need: of one the bin, of a nearer one its node, of the next the state.

    What these will be is known unless a bin is opened before or is chosen twice; then the wrong memory is fetched.
    """
    rows = len(uniforms)
    far, middle, near = row + 12, row + 8, row + 4
    if far < rows:
        number = order[peek(head, 0, uniforms[far, 0], 12)]
        ahead[far & (AHEAD - 1)] = number
        prefetch(heads, number)
    if middle < rows:
        place = peek(heads, ahead[middle & (AHEAD - 1)], uniforms[middle, 1], 0)
        ahead[middle & (AHEAD - 1)] = place
        prefetch(pool, place)
    if near < rows:
        prefetch(states, pool[ahead[near & (AHEAD - 1)]])


@njit(types.Tuple((types.int64, types.boolean))(
    PARAMETERS_TYPE, _integers, _matrix, types.UniTuple(types.int64, 2),
    COLUMNS_TYPE, types.int64, types.int64, QUEUE_TYPE, _vector, _matrix), error_model="numpy")
def expand(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, bounds: Array,
           durations: tuple[int, int], columns: Columns, first: int, most: int, queue: BinQueue, bin_size: Array,
           uniforms: Array) -> tuple[int, bool]:
    """Expand a node for each row of `uniforms` [B, 2 + A (+ 1)]: bin, node, control, and its duration.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        bounds: Lower and upper bounds of the controls [2, A].
        durations: The least and the most steps of a control; if these are equal, `uniforms` has no column for
            them.
        columns, first: The tree's arrays, with space for `most` more nodes, and the number of nodes so far.
        most: The most steps, of all controls together.
        queue, bin_size: The counters, with space for `most` more nodes, and the edges of the bins [F].

    Returns:
        How many nodes were written, and whether the last one is the goal. A state that is not finite ends the loop
        as well; it is the last one and not in the queue.
    """
    address, reals, table, integers = uncounted(parameters)
    states, features, controls, parents, rewards, ends = uncounted(columns)
    queue, uniforms, bounds = uncounted(queue), uncounted(uniforms), uncounted(bounds)
    bin_size, feature_dims = uncounted(bin_size), uncounted(feature_dims)
    pool, heads, order, head, runs, totals = queue.pool, queue.heads, queue.order, queue.head, queue.runs, queue.totals
    cells, places = queue.cells, queue.table
    least, longest = durations
    cell, ahead = np.empty(len(bin_size), np.int64), np.zeros(AHEAD, np.int64)
    child, end, large = first, first + most, first >= LARGE
    for row in range(len(uniforms)):
        if large:
            _fetch(row, uniforms, ahead, order, head, heads, pool, states)
        node = choose(pool, heads, runs, totals, choose(order, head, runs, totals, 0, uniforms[row, 0]),
                      uniforms[row, 1])
        steps = longest
        if longest > least:
            steps = least + int(uniforms[row, 2 + bounds.shape[1]] * (longest - least + 1))
        for _ in range(min(steps, end - child)):
            for axis in range(bounds.shape[1]):
                low, high = bounds[0, axis], bounds[1, axis]
                controls[child, axis] = low + (high - low) * uniforms[row, 2 + axis]
            reward, terminal, success = call_step(address, reals, table, integers, states, node, controls, child)
            for axis in range(len(feature_dims)):
                features[child, axis] = states[child, feature_dims[axis]]
            parents[child], rewards[child], ends[child] = node, reward, terminal
            node, child = child, child + 1
            if not finite(states, node):
                return child - first, False
            if not terminal:
                cell_of(features, node, bin_size, queue.turns, cell)
                place = find_cell(cells, places, cell)
                if not add(pool, heads, runs, totals, places[place] - 1, node):
                    grow_and_add(queue, cell, place, node)
            if success:
                return child - first, True
            if terminal:
                break
    return child - first, False
