"""How an update runs: eager or compiled, on which device, on how many threads, with denormal numbers or without."""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np
import torch

from pbcs_ompl.core.errors import InvalidOption

Compile = bool | Literal["auto"]
PARALLEL_WORK = 3_000_000
"""Multiplications in the largest matrix product from which a second thread pays."""


def choose_device(name: str | torch.device) -> torch.device:
    """Return the device.

    Raises:
        InvalidOption: the device does not exist, or is not available.
    """
    try:
        device = torch.device(name)
    except RuntimeError as error:
        raise InvalidOption(f"unknown device {name!r}; choose 'cpu' or 'cuda'") from error
    if device.type == "cuda" and not torch.cuda.is_available():
        raise InvalidOption(f"device is {str(name)!r}, but torch sees no CUDA device; use 'cpu'")
    return device


def compiled(function: Callable[..., Any], compile: Compile, device: torch.device, *,
             record: bool) -> Callable[..., Any]:
    """Return `function`, compiled by torch if `compile` is True; "auto" does so on CUDA only.

    On a CPU the hand-written gradients leave torch's compiler 5 to 20 %, for which it would take 5 to 40 s;
    there an algorithm may have a kernel, which is faster than both. When compilation fails, the function
    runs uncompiled, with one warning.

    Args:
        function: What is compiled.
        compile: True, False or "auto".
        device: Where it will run.
        record: Whether autograd records losses in it.

    Raises:
        InvalidOption: `compile` is none of True, False, "auto".
    """
    if compile not in (True, False, "auto"):
        raise InvalidOption(f"compile is {compile!r}, expected True, False or 'auto'")
    if compile is False or (compile == "auto" and device.type == "cpu"):
        return function
    return _CompiledOrNot(function, record)


class _CompiledOrNot:
    """Compiles at the first call, and falls back for good when that fails.

    A compilation fails before anything has run, so nothing is done twice.
    """

    def __init__(self, function: Callable[..., Any], record: bool):
        self._plain = function
        from torch._dynamo.exc import TorchDynamoException  # takes a second to import

        self._failure = TorchDynamoException
        chosen: Callable[..., Any] = torch.compile(function, fullgraph=True, dynamic=False)
        self._chosen = _trace_autograd(chosen) if record else chosen

    def __call__(self, *arguments: Any) -> Any:
        try:
            return self._chosen(*arguments)
        except self._failure as error:
            if self._chosen is self._plain:
                raise
            reason = str(error).strip().partition("\n")[0]
            message = f"torch.compile failed, running uncompiled: {reason}"
            warnings.warn(message, RuntimeWarning, stacklevel=2)
            self._chosen = self._plain
            return self._plain(*arguments)


def _trace_autograd(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let torch's compiler trace the gradients of losses; versions that cannot do it refuse to compile them."""
    from torch._dynamo import config

    if "trace_autograd_ops" not in config.get_config_copy():
        return function
    traced: Callable[..., Any] = config.patch(trace_autograd_ops=True)(function)
    return traced


@contextmanager
def one_thread() -> Iterator[None]:
    """Let torch use one thread: small products gain nothing from more, and their number changes the rounding."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


@contextmanager
def quick_arithmetic(work: int, *, record: bool) -> Iterator[None]:
    """Run small products on one thread, and round denormal numbers to zero.

    Adam's moments of units that are never active decay for ever; as denormal numbers they would slow all updates.

    Args:
        work: Multiplications in the largest matrix product.
        record: Whether autograd will record losses. If not, torch's inference mode saves a tenth of the time.
    """
    threads = torch.get_num_threads()
    flushed_before = float(np.float32(1e-40) * np.float32(0.5)) == 0.0
    if work < PARALLEL_WORK and threads > 1:
        torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        with torch.no_grad() if record else torch.inference_mode():
            yield
    finally:
        torch.set_flush_denormal(flushed_before)
        if torch.get_num_threads() != threads:
            torch.set_num_threads(threads)
