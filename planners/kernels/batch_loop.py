"""A batch of controls that last several steps, in compiled code."""

from numba import types

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import call_step
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE, finite
from pbcs_ompl.planners.kernels.memory import uncounted

_integers = types.int64[::1]


@njit(types.Tuple((types.int64, types.boolean))(
    PARAMETERS_TYPE, _integers, COLUMNS_TYPE, types.int64, types.int64, _integers, types.float64[:, ::1],
    _integers))
def expand(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, columns: Columns,
           first: int, most: int, nodes: IndexArray, actions: Array, durations: IndexArray) -> tuple[int, bool]:
    """Apply actions [B, A] from nodes [B] for `durations` [B] steps: the first step of all, the second, and so on.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        columns, first: The tree's arrays, with space for `most` more nodes, and the number of nodes so far.
        most: The most steps, of all controls together.
        nodes, actions, durations: What to do.

    Returns:
        How many nodes were written, and whether the last one is the goal; a state that is not finite is the last as
        well.
    """
    address, reals, table, integers = uncounted(parameters)
    states, features, controls, parents, rewards, ends = uncounted(columns)
    at = nodes.copy()  # where each control is; -1 where it ended
    child, taken, going = first, 0, True
    while going:
        going = False
        for k in range(len(at)):
            if at[k] < 0 or durations[k] <= taken:
                continue
            if child == first + most:
                return child - first, False
            for axis in range(actions.shape[1]):
                controls[child, axis] = actions[k, axis]
            reward, terminal, success = call_step(address, reals, table, integers, states, at[k], controls, child)
            for axis in range(len(feature_dims)):
                features[child, axis] = states[child, feature_dims[axis]]
            parents[child], rewards[child], ends[child] = at[k], reward, terminal
            at[k] = -1 if terminal else child
            child += 1
            if success or not finite(states, child - 1):
                return child - first, success
            going = True
        taken += 1
    return child - first, False
