"""Compile with Numba and keep the result on disk, where there is a place for it."""

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from hashlib import blake2b
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numba

from pbcs_ompl.core.announcement import announce
from pbcs_ompl.core.collector import no_collection
from pbcs_ompl.core.scratch import scratch_folder

Function = TypeVar("Function", bound=Callable[..., Any])
announce()


def njit(*signature: Any, **options: Any) -> Callable[[Function], Function]:
    """Return a decorator that compiles without Python and caches the machine code.

    Numba looks for a newer version only in the file of the function, not in those of the kernels that it calls, so the
    names of cached files have a digest of all of them. It caches beside the source, else in the home of the user. Where
    it can write in neither (a read-only
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
                return _cached(function, *signature, **options)
            except (RuntimeError, OSError) as error:
                if isinstance(error, RuntimeError) and "cannot cache" not in str(error):
                    raise
        uncached: Function = numba.njit(*signature, **options)(function)
        return uncached

    return decorate


def _cached(function: Function, *signature: Any, **options: Any) -> Function:
    """Compile with a cache; Numba makes the names of its files of the function's name when it is defined."""
    name = function.__qualname__
    function.__qualname__ = f"{name}-{kernel_digest()}"
    try:
        with no_collection(), _without_scipy():  # the first one loads the half of Numba
            compiled: Function = numba.njit(*signature, cache=True, no_cfunc_wrapper=True, **options)(function)
    finally:
        function.__qualname__ = name
    return compiled


@contextmanager
def _without_scipy() -> Iterator[None]:
    """Let Numba load without SciPy's linear algebra, which takes a sixth of the time that `pbcs plan` needs.

    Numba imports it to see whether it is there, and it is, since we depend on it. Functions that call it import it when
    they are compiled.
    """
    linear_algebra: Any = import_module("numba.np.linalg")
    usual = getattr(linear_algebra, "ensure_blas", _usual)  # it is no public name of Numba's
    linear_algebra.ensure_blas = _usual
    try:
        yield
    finally:
        linear_algebra.ensure_blas = usual


def kernel_files() -> list[Path]:
    """Return the sources of the kernels that others call: all in folders or files called `kernels` or `compiled`."""
    root = Path(__file__).parents[1]
    found = []
    for place, folders, names in os.walk(root, followlinks=True):  # planners and envs are links in a checkout
        folders[:] = sorted(folder for folder in folders if folder != "__pycache__")
        for name in sorted(names):
            if name.endswith(".py") and ("kernels" in name or name == "compiled.py" or Path(place).name == "kernels"):
                found.append(Path(place) / name)
    return found


@cache
def kernel_digest() -> str:
    """Return a digest of the sources of all kernels."""
    digest = blake2b(digest_size=6)
    for path in kernel_files():
        digest.update(path.read_bytes())
    return digest.hexdigest()


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
