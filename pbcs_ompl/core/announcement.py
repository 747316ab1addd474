"""Says that a first run compiles: some seconds in which nothing else would be seen."""

import logging
import time
from typing import Any

from numba.core import event

LOGGER = logging.getLogger("pbcs_ompl")
SECONDS_BETWEEN_LINES = 3.0
PATIENCE = 0.5
"""Seconds of compilation before the first line: a kernel or two are not worth one."""


class CompilationListener(event.Listener):  # type: ignore[misc] # Numba has no types
    """Logs what compiling takes, as warnings: without other settings, Python shows them on the standard error."""

    def __init__(self) -> None:
        self._depth, self._kernels = 0, 0
        self._seconds = self._began = 0.0
        self._due = PATIENCE

    def on_start(self, event: Any) -> None:
        """Note that a kernel is compiled; kernels that it calls are compiled meanwhile."""
        if self._depth == 0:
            self._began = time.perf_counter()
        self._depth += 1
        self._report(time.perf_counter() - self._began)

    def on_end(self, event: Any) -> None:
        """Note that it has been."""
        self._depth -= 1
        self._kernels += 1
        seconds = time.perf_counter() - self._began
        self._report(seconds)
        if self._depth == 0:
            self._seconds += seconds

    def _report(self, seconds: float) -> None:
        total = self._seconds + seconds
        if total < self._due:
            return
        if self._due == PATIENCE:
            LOGGER.warning("compiling kernels, once, about 5 s for a plan, 10 s for a training; later runs load them")
        else:
            LOGGER.warning("compiled %d kernels in %.0f s", self._kernels, total)
        self._due = total + SECONDS_BETWEEN_LINES


def announce() -> None:
    """Log what this process compiles from now on."""
    event.register("numba:compile", CompilationListener())
