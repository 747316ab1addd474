"""SST as one compiled loop."""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.core.types import npy_rng

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.motion import GOING, REACHED, draw_control, draw_duration, move, to_surface
from pbcs_ompl.planners.kernels.witnesses import WITNESSES_TYPE, Witnesses, choose, note

_matrix = types.float64[:, ::1]
_vector = types.float64[::1]
NO_PATH = 1 << 31
"""Steps of the shortest path while there is none."""


class Focus(NamedTuple):
    """Where targets are drawn."""

    box: Array
    """Lower and upper bounds of the features [2, F], in bins."""
    path: IndexArray
    """The nodes of the shortest path so far [T+1]; empty while there is none."""
    share: float
    """The share of the targets that are drawn around nodes of the path."""


FOCUS_TYPE = types.NamedTuple((_matrix, types.int64[::1], types.float64), Focus)


@njit()
def steps_of(path: IndexArray) -> int:
    """Return the steps of a path."""
    return len(path) - 1 if len(path) else NO_PATH


@njit(error_model="numpy")
def draw_target(focus: Focus, features: Array, size: Array, radius: float, point: Array,
                rng: np.random.Generator) -> None:
    """Write a random feature into `point` [1, F], in bins: uniform in the box, or within a radius of the path.

    Args:
        focus: Where targets are drawn.
        features, size: Those of the nodes [N, F], and how long a bin is [F].
        radius: In bins, along each axis.
        point: The target.
        rng: The random numbers.
    """
    beside = len(focus.path) > 0 and focus.share > 0.0 and rng.random() < focus.share
    node = focus.path[int(rng.random() * len(focus.path))] if beside else np.int64(0)
    for axis in range(len(size)):
        if beside:
            point[0, axis] = features[node, axis] / size[axis] + radius * (2.0 * rng.random() - 1.0)
        else:
            point[0, axis] = focus.box[0, axis] + (focus.box[1, axis] - focus.box[0, axis]) * rng.random()


@njit(types.Tuple((types.int64, types.boolean))(
    PARAMETERS_TYPE, types.int64[::1], _matrix, types.UniTuple(types.int64, 2), COLUMNS_TYPE, types.int64,
    types.int64, FOCUS_TYPE, WITNESSES_TYPE, _vector, types.UniTuple(types.float64, 2), types.float64, npy_rng),
    error_model="numpy")
def expand(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, bounds: Array,
           durations: tuple[int, int], columns: Columns, first: int, most: int, focus: Focus, witnesses: Witnesses,
           size: Array, radii: tuple[float, float], surface: float, rng: np.random.Generator) -> tuple[int, bool]:
    """Add motions of at most `most` steps together.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        bounds: Lower and upper bounds of the controls [2, A].
        durations: The least and the most steps of a control.
        columns, first: The tree's arrays, with space for `most` more nodes, and the number of nodes so far.
        most: The most steps, at least the longest duration unless no more are left.
        focus: Where targets are drawn, and the shortest path so far.
        witnesses: With space for `most` more.
        size: How long a bin is [F].
        radii: Of selection and of pruning, in bins.
        surface: The share of the controls that are scaled to the surface of their bounds.
        rng: The random numbers.

    Returns:
        How many nodes were written, and whether the last one is the goal.
    """
    parameters, columns, witnesses = uncounted(parameters), uncounted(columns), uncounted(witnesses)
    point, found, best = np.empty((1, len(size))), np.empty(1, np.int64), steps_of(focus.path)
    child, end = first, first + most
    while child == first or child + durations[1] <= end:
        draw_target(focus, columns.features, size, radii[0], point, rng)
        chosen = choose(witnesses, point, radii[0], best)
        node, cost = np.int64(witnesses.nodes[chosen]), np.int64(witnesses.costs[chosen])
        draw_control(bounds, columns.controls, child, rng)
        if surface > 0.0 and rng.random() < surface:
            to_surface(bounds, columns.controls, child)
        rest: Any = best - 1 - cost
        steps: int = min(draw_duration(durations, rng), end - child, rest)
        begin = child
        child, how = move(parameters, feature_dims, columns, node, child, steps)
        if how >= REACHED:
            return child - first, how == REACHED
        if how == GOING:
            for axis in range(len(size)):
                point[0, axis] = columns.features[child - 1, axis] / size[axis]
            note(witnesses, point, found, child - 1, cost + child - begin, radii[1])
    return child - first, False
