"""Compile with Numba and keep the result on disk, where there is a place for it."""

import os
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import numba

from pbcs_ompl.core.scratch import scratch_folder

Function = TypeVar("Function", bound=Callable[..., Any])


def njit(*signature: Any, **options: Any) -> Callable[[Function], Function]:
    """Return a decorator that compiles without Python and caches the machine code.

    Numba caches beside the source, else in the home of the user. Where it can write in neither (a read-only
    installation without a home), it raises when the function is defined; then a temporary folder takes their place, and
    where there is none of these either, the function is compiled in each process.

    Args:
        signature: At most one, the types to compile for at once; without it, functions are compiled when called.
        options: Those of `numba.njit`.
    """
    def decorate(function: Function) -> Function:
        for places in (_usual, _temporary):
            try:
                places()
                compiled: Function = numba.njit(*signature, cache=True, **options)(function)
                return compiled
            except (RuntimeError, OSError) as error:
                if isinstance(error, RuntimeError) and "cannot cache" not in str(error):
                    raise
        uncached: Function = numba.njit(*signature, **options)(function)
        return uncached

    return decorate


def _usual() -> None:
    """Let Numba choose where to cache."""


def _temporary() -> None:
    """Cache in a temporary folder from now on, in the processes that this one starts too; say so once."""
    if "NUMBA_CACHE_DIR" in os.environ and os.environ["NUMBA_CACHE_DIR"] == numba.config.CACHE_DIR:
        return
    folder = str(scratch_folder())
    os.environ["NUMBA_CACHE_DIR"] = numba.config.CACHE_DIR = folder
    warnings.warn(f"neither the installation nor the home can be written; compiled code is kept in {folder} "
                  "(set NUMBA_CACHE_DIR for another place)", stacklevel=2)
