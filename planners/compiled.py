"""Environments whose step is compiled, and strategies that then run as one compiled loop.

A call of `transition` from Python costs ten microseconds whatever the batch, and Ex loses its depth-first
dives when many nodes are expanded together. Where both the strategy and the step are compiled, nodes are
expanded one at a time at full speed, and the tree is that of `batch=1`, bit for bit.
"""

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher

from pbcs_ompl.core.errors import CallbackFailed
from pbcs_ompl.core.step_kernels import INTEGERS, MATRIX, STEP_SIGNATURE, VECTOR, address_of
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray

PARAMETERS_TYPE = types.Tuple((types.uintp, VECTOR, MATRIX, INTEGERS))
"""What compiled loops take of a CompiledStep: they are compiled once and cached, whatever the environment."""


class CompiledStep(NamedTuple):
    """A step in the form of a function for Numba, and its parameters; equals `transition` bit for bit."""

    step: Any
    """`step(reals, table, integers, states, parent, controls, child) -> (reward, terminated, success)`
    advances states[parent] under controls[child] and writes states[child]. It is compiled with
    @njit("Tuple((f8, b1, b1))(f8[::1], f8[:, ::1], i8[::1], f8[:, ::1], i8, f8[:, ::1], i8)", cache=True).
    Rows are given by index because a view of a row costs as much as the step of a point."""
    reals: Array
    table: Array
    """Real parameters in rows."""
    integers: IndexArray
    address: int
    """Where the machine code of `step` is; it lives as long as `step`."""

    @property
    def parameters(self) -> tuple[int, Array, Array, IndexArray]:
        """What compiled loops take."""
        return self.address, self.reals, self.table, self.integers


@runtime_checkable
class CompiledModel(Protocol):
    """A model (see core.interfaces.ResettableModel) that offers its step to compiled loops."""

    def compiled_step(self) -> tuple[Any, Array, Array, IndexArray] | None:
        """Return the step, its real and its integer parameters; None where this model has none."""
        ...


@runtime_checkable
class CompiledStrategy(Protocol):
    """A strategy that can expand many nodes, one after the other, in one compiled call."""

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Expand nodes by at least one step, at most `count`, or until the goal; return the goal's node, or -1.

        The new nodes lie in the tree and the strategy knows them. A step to a state that is not finite ends the call
        as well; that state is the tree's last.
        """
        ...


def step_of(model: Any) -> CompiledStep | None:
    """Return the compiled step of a model, with its own copies of the parameters; None where there is none.

    Raises:
        CallbackFailed: the step is not compiled for the signature.
    """
    offered = model.compiled_step() if isinstance(model, CompiledModel) else None
    if offered is None:
        return None
    step, reals, table, integers = offered
    if not isinstance(step, Dispatcher) or STEP_SIGNATURE.args not in step.signatures:
        raise CallbackFailed(f"compiled_step of {model.spec.id} returned {step!r}; expected a function "
                             f"compiled by @njit(signature), where the signature is {STEP_SIGNATURE}")
    return CompiledStep(step, np.array(reals, np.float64), np.array(table, np.float64, order="C"),
                        np.array(integers, np.int64), address_of(step))
