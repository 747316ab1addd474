"""A control that is applied for several steps, each a node: what OMPL's planners call a motion."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import call_step
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.kernels.columns import finite
from pbcs_ompl.planners.kernels.runs import Number

GOING, ENDED, REACHED, NOT_FINITE = range(4)
"""How a motion ended: after its last step, in a terminal state, in the goal, in a state that is not finite."""


@njit(inline="always")
def draw_control(bounds: Array, controls: Array, child: int, rng: np.random.Generator) -> None:
    """Write a control that is uniform in its bounds [2, A] into controls[child]."""
    for axis in range(bounds.shape[1]):
        controls[child, axis] = bounds[0, axis] + (bounds[1, axis] - bounds[0, axis]) * rng.random()


@njit()
def to_surface(bounds: Array, controls: Array, row: int) -> None:
    """Scale controls[row] to the surface of its bounds [2, A], as seen from their middle."""
    largest = 0.0
    for axis in range(bounds.shape[1]):
        middle, half = (bounds[0, axis] + bounds[1, axis]) / 2.0, (bounds[1, axis] - bounds[0, axis]) / 2.0
        if half > 0.0:
            largest = max(largest, abs(controls[row, axis] - middle) / half)
    if largest == 0.0:
        return
    for axis in range(bounds.shape[1]):
        middle = (bounds[0, axis] + bounds[1, axis]) / 2.0
        scaled = middle + (controls[row, axis] - middle) / largest
        controls[row, axis] = min(max(scaled, bounds[0, axis]), bounds[1, axis])


@njit(inline="always")
def draw_duration(durations: tuple[int, int], rng: np.random.Generator) -> int:
    """Return how many steps a control lasts."""
    least, longest = durations
    return least + int(rng.random() * (longest - least + 1)) if longest > least else least


@njit(error_model="numpy")
def move(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, columns: Columns, node: Number,
         child: int, steps: int) -> tuple[int, int]:
    """Apply the control in controls[child] from a node for `steps` steps.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        columns: The tree's arrays, with space for the new nodes.
        node, child: Where the motion begins, and the number of its first new node.
        steps: The most steps.

    Returns:
        The number of the first node behind the motion, and how it ended.
    """
    address, reals, table, integers = parameters
    states, features, controls, parents, rewards, ends = columns
    begin = child
    for _ in range(steps):
        for axis in range(controls.shape[1]):
            controls[child, axis] = controls[begin, axis]
        reward, terminal, success = call_step(address, reals, table, integers, states, node, controls, child)
        for axis in range(len(feature_dims)):
            features[child, axis] = states[child, feature_dims[axis]]
        parents[child], rewards[child], ends[child] = node, reward, terminal
        node, child = child, child + 1
        if success:
            return child, REACHED
        if not finite(states, node):
            return child, NOT_FINITE
        if terminal:
            return child, ENDED
    return child, GOING
