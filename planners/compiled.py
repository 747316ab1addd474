"""Environments whose step is compiled, and strategies that then run as one compiled loop.

A call of `transition` from Python costs ten microseconds whatever the batch, and Ex loses its depth-first dives when
many nodes are expanded together. Where both the strategy and the step are compiled, nodes are expanded one at a
time at full speed, and the tree is that of `batch=1`, bit for bit.
"""

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numba import types

from pbcs_ompl.core.contracts import Array, IndexArray
from planners.tree import Tree

_vector = types.float64[::1]
_integers = types.int64[::1]
STEP_SIGNATURE = types.Tuple((types.float64, types.boolean, types.boolean))(
    _vector, _integers, _vector, _vector, _vector)
STEP_TYPE = types.FunctionType(STEP_SIGNATURE)
"""A first-class function, so that loops over steps are compiled once and cached, whatever the environment."""


class CompiledStep(NamedTuple):
    """A step in the form of a function for Numba; equals `transition` bit for bit."""

    step: Any
    """`step(reals, integers, state [D], control [A], after [D]) -> (reward, terminated, success)` writes the next
    state into `after`. Compiled with @njit(signature, cache=True), where the signature is
    "Tuple((float64, boolean, boolean))(float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])"."""
    reals: Array
    integers: IndexArray


@runtime_checkable
class CompiledModel(Protocol):
    """A model (see core.contracts.ResetAnywhere) that offers its step to compiled loops."""

    def compiled_step(self) -> CompiledStep | tuple[Any, Array, IndexArray] | None:
        """Return the step, its real and its integer parameters; None where this model has none."""
        ...


@runtime_checkable
class CompiledStrategy(Protocol):
    """A strategy that can expand many nodes, one after the other, in one compiled call."""

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Expand `count` nodes, or until the goal; return the goal's node, or -1.

        The new nodes lie in the tree and the strategy knows them. An expansion that gives a state that is not
        finite ends the call as well; that state is the tree's last.
        """
        ...


def step_of(model: Any) -> CompiledStep | None:
    """Return the compiled step of a model in the types that the loops expect, or None."""
    offered = model.compiled_step() if isinstance(model, CompiledModel) else None
    if offered is None:
        return None
    step, reals, integers = offered
    return CompiledStep(step, np.ascontiguousarray(reals, np.float64), np.ascontiguousarray(integers, np.int64))
