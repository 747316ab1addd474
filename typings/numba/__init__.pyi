# The part of Numba that this project uses; Numba brings no types of its own.
from collections.abc import Callable
from typing import Any, TypeVar, overload

Function = TypeVar("Function", bound=Callable[..., Any])

@overload
def njit(function: Function) -> Function: ...
@overload
def njit(*signature: Any, cache: bool = ..., parallel: bool = ..., fastmath: Any = ..., inline: str = ...,
         nogil: bool = ..., boundscheck: bool = ..., error_model: str = ...,
         no_cfunc_wrapper: bool = ...) -> Callable[[Function], Function]: ...

prange = range

def get_num_threads() -> int: ...
def set_num_threads(n: int) -> None: ...
def __getattr__(name: str) -> Any: ...
