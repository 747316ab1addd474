"""OMPL's EST as one compiled loop, and the sum tree by which cells are drawn in proportion to their weights."""

import numpy as np
from numba import types
from numba.core.types import npy_rng

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE
from pbcs_ompl.planners.kernels.grid import GRID_TYPE, Grid, put
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.motion import GOING, REACHED, draw_control, draw_duration, move
from pbcs_ompl.planners.kernels.runs import Number

_matrix = types.float64[:, ::1]
_vector = types.float64[::1]
_integers = types.int64[::1]


@njit()
def weigh(weights: Array, number: Number, weight: float) -> None:
    """Give a cell its weight. Leaf `number` of C is weights[C + number], inner node i is the sum of 2i and 2i + 1."""
    place = len(weights) // 2 + number
    weights[place] = weight
    while place > 1:
        place //= 2
        weights[place] = weights[2 * place] + weights[2 * place + 1]


@njit()
def select(grid: Grid, weights: Array, rng: np.random.Generator) -> Number:
    """Return a random node of a cell that is drawn in proportion to its weight."""
    place, rest = 1, rng.random() * weights[1]
    while place < len(weights) // 2:
        place *= 2
        if rest >= weights[place] and weights[place + 1] > 0.0:
            rest -= weights[place]
            place += 1
    number = place - len(weights) // 2
    node: Number = np.int64(grid.pool[grid.slices[number].start + int(rng.random() * grid.slices[number].length)])
    return node


@njit()
def insert(grid: Grid, weights: Array, features: Array, node: int, size: Array, cell: IndexArray) -> None:
    """Add a node; its cell weighs 1 / (nodes in it)."""
    number, _ = put(grid, features, node, size, cell)
    weigh(weights, number, 1.0 / grid.slices[number].length)


@njit(types.Tuple((types.int64, types.boolean))(
    PARAMETERS_TYPE, _integers, _matrix, types.UniTuple(types.int64, 2), COLUMNS_TYPE, types.int64, types.int64,
    GRID_TYPE, _vector, _vector, npy_rng), error_model="numpy")
def expand(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, bounds: Array,
           durations: tuple[int, int], columns: Columns, first: int, most: int, grid: Grid, weights: Array,
           size: Array, rng: np.random.Generator) -> tuple[int, bool]:
    """Add motions of at most `most` steps together.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        bounds: Lower and upper bounds of the controls [2, A].
        durations: The least and the most steps of a control.
        columns, first: The tree's arrays, with space for `most` more nodes, and the number of nodes so far.
        most: The most steps, at least the longest duration unless no more are left.
        grid, weights, size: The cells with space for `most` more, their weights [2C], and their edges [F].
        rng: The random numbers.

    Returns:
        How many nodes were written, and whether the last one is the goal.
    """
    parameters, columns, grid, weights = uncounted(parameters), uncounted(columns), uncounted(grid), uncounted(weights)
    cell = np.empty(len(size), np.int64)
    child, end = first, first + most
    while child == first or child + durations[1] <= end:
        node = select(grid, weights, rng)
        draw_control(bounds, columns.controls, child, rng)
        steps = min(draw_duration(durations, rng), end - child)
        child, how = move(parameters, feature_dims, columns, node, child, steps)
        if how == GOING:
            insert(grid, weights, columns.features, child - 1, size, cell)
        elif how >= REACHED:
            return child - first, how == REACHED
    return child - first, False
