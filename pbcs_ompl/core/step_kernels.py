"""The step of an environment as a function for compiled loops: its signature, and how a loop calls it.

Loops take the address of the machine code and not the function, so that each is compiled once and cached, whatever the
environment.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, BoolArray, IndexArray

VECTOR, MATRIX, INTEGERS = types.float64[::1], types.float64[:, ::1], types.int64[::1]
STEP_SIGNATURE = types.Tuple((types.float64, types.boolean, types.boolean))(
    VECTOR, MATRIX, INTEGERS, MATRIX, types.int64, MATRIX, types.int64)
"""step(reals, table, integers, states, parent, controls, child) writes states[child] from states[parent] and
controls[child], and returns reward, terminated, success."""
_FLAGS = types.boolean[::1]
_BATCH = types.Tuple((MATRIX, VECTOR, _FLAGS, _FLAGS))(types.uintp, VECTOR, MATRIX, INTEGERS, MATRIX, MATRIX)


@cache
def address_of(step: Any) -> int:
    """Return where this process has the machine code of a function that is compiled for `STEP_SIGNATURE`."""
    compiled = step.get_compile_result(STEP_SIGNATURE)
    address: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return address


@intrinsic
def call_step(typing_context: Any, address: Any, reals: Any, table: Any, integers: Any, states: Any, parent: Any,
              controls: Any, child: Any) -> Any:
    """Call the step at an address; see `address_of`.

    Numba's own first-class functions do the same, but take 0.2 ms to enter a loop.
    """
    result, arguments = STEP_SIGNATURE.return_type, STEP_SIGNATURE.args

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        convention = context.call_conv
        pointer = builder.inttoptr(values[0], convention.get_function_type(result, arguments).as_pointer())
        status, value = convention.call_function(builder, pointer, result, arguments, values[1:])
        with builder.if_then(status.is_error, likely=False):
            convention.return_status_propagate(builder, status)
        return value

    return result(types.uintp, *arguments), generate


@njit(_BATCH)
def step_batch(address: int, reals: Array, table: Array, integers: IndexArray, states: Array, controls: Array) -> tuple[
        Array, Array, BoolArray, BoolArray]:
    """Return the next states [B, D], rewards, terminated and success [B] of states [B, D] under controls [B, A].

    Args:
        address: Of the step; see `address_of`.
        reals, table, integers: What the step takes.
        states, controls: [B, D] and [B, A].
    """
    count = states.shape[0]
    rows, given = np.concatenate((states, states)), np.concatenate((controls, controls))
    rewards, terminated, success = np.empty(count), np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.bool_)
    for k in range(count):
        rewards[k], terminated[k], success[k] = call_step(address, reals, table, integers, rows, k, given, count + k)
    return rows[count:].copy(), rewards, terminated, success
