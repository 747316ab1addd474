"""A worker process as its parent sees it: one run at a time, watched, and killed when it exceeds a limit."""

import math
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import wait
from typing import Any

import psutil

from pbcs_ompl.experiments.workers.serving import READY, Ended, serve

SECONDS_BETWEEN_LOOKS = 0.1
"""How often the memory of a worker is measured; nobody tells when it grows."""
MEMORY_AT_REST = 0.5
"""A worker that holds more than this share of its limit between two runs is replaced: the next run owes nothing."""
SECONDS_TO_LEAVE = 5.0
SPAWN = get_context("spawn")


class Worker:
    """A spawned process that is reused from run to run, and replaced after a run that took it down.

    Args:
        run: Makes a record of a job; found by name in the other process.
        max_seconds: Wall time of one run, counted from when the process is ready; None for any.
        max_memory: Resident memory of the process, in MB; None for any.
    """

    def __init__(self, run: Callable[[Any], Any], max_seconds: float | None = None, max_memory: float | None = None):
        self._run, self._max_seconds, self._max_memory = run, max_seconds, max_memory
        self._start()

    def _start(self) -> None:
        self.connection, theirs = SPAWN.Pipe()
        self._process = SPAWN.Process(target=serve, args=(self._run, theirs))
        self._process.start()
        self._measured = psutil.Process(self._process.pid)
        theirs.close()
        self._is_ready, self._deadline = False, math.inf

    def begin(self, job: Any) -> None:
        """Begin a run; in a new process if the old one is gone or has kept too much memory."""
        self.job = job
        if not self._process.is_alive():
            self._start()
        elif self._max_memory is not None and self._megabytes() > MEMORY_AT_REST * self._max_memory:
            self.kill()
            self._start()
        elif self._is_ready:
            try:
                self._send()
            except BrokenPipeError:  # it died after its last run
                self._start()

    def look(self) -> Ended | None:
        """Return how the run ended, None while it goes on. Never blocks."""
        try:
            if self.connection.poll():
                message = self.connection.recv()
                if message is not READY:
                    return message
                self._is_ready = True
                self._send()
        except (EOFError, OSError):
            self.kill()
            return Ended(reason=self._why_it_died())
        reason = self._excess()
        if reason is not None:
            self.kill()
            return Ended(reason=reason)
        return None

    def seconds_to_wait(self) -> float | None:
        """Return after how long to look again although the process has said nothing; None for never."""
        left = max(0.0, self._deadline - time.monotonic())
        if self._max_memory is not None:
            left = min(left, SECONDS_BETWEEN_LOOKS)
        return None if math.isinf(left) else left

    def make(self, job: Any) -> Ended:
        """Make one run and wait for its end."""
        self.begin(job)
        while (ended := self.look()) is None:
            wait([self.connection], self.seconds_to_wait())
        return ended

    def dismiss(self) -> None:
        """Let the process end by itself."""
        self.connection.close()
        self._process.join(SECONDS_TO_LEAVE)
        self.kill()

    def kill(self) -> None:
        """End the process and those that it started, whatever they do."""
        self.connection.close()
        with suppress(psutil.NoSuchProcess):  # it is gone already
            for process in [*self._measured.children(recursive=True), self._measured]:
                process.kill()
        self._process.join()

    def _send(self) -> None:
        self._deadline = math.inf if self._max_seconds is None else time.monotonic() + self._max_seconds
        self.connection.send(self.job)

    def _excess(self) -> str | None:
        if time.monotonic() >= self._deadline:
            return f"stopped from outside after {self._max_seconds:g} s, the limit of one run"
        megabytes = 0.0 if self._max_memory is None else self._megabytes()
        if self._max_memory is not None and megabytes > self._max_memory:
            return f"stopped from outside at {megabytes:.0f} MB of memory; the limit of one run is {self._max_memory:g}"
        return None

    def _megabytes(self) -> float:
        try:
            return self._measured.memory_info().rss / 1e6
        except psutil.NoSuchProcess:
            return 0.0

    def _why_it_died(self) -> str:
        code = self._process.exitcode or 0
        how = signal.strsignal(-code) if code < 0 else f"exit status {code}"
        guard = "" if self._is_ready else " (or a script without if __name__ == '__main__': around its calls)"
        return f"the process died, {how}: a crash in C++, or out of memory{guard}"
