"""A worker process: it makes one run after another; its parent watches it, and kills it when it exceeds a limit."""

import json
import math
import os
import signal
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait

import psutil

from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.plain import plain
from pbcs_ompl.experiments.run import Failure, Record, Run, RunFunction

SECONDS_BETWEEN_POLLS = 0.1
"""How often the memory of a worker is measured; the system does not report when it grows."""
IDLE_MEMORY_FRACTION = 0.5
"""A worker that holds more than this share of its limit between two runs is replaced: each run has the rest of it."""
SHUTDOWN_TIMEOUT = 5.0
"""Seconds within which an idle process has to end by itself."""
READY = None
"""The first message of a worker: it has imported what its runs need."""
SPAWN = get_context("spawn")


@dataclass(frozen=True)
class Limits:
    """What one run may use. A run that uses more is killed.

    Attributes:
        max_seconds: Wall time, counted from when its process is ready; None for any.
        max_memory: Resident memory of its process, in MB of 10^6 bytes; None for any.

    Raises:
        InvalidOption: a limit is not positive.
    """

    max_seconds: float | None = None
    max_memory: float | None = None

    def __post_init__(self) -> None:
        for name, limit in vars(self).items():
            check_range(name, limit, limit is None or limit > 0, "more than 0")


class Worker:
    """A spawned process that is reused from run to run, and replaced after a run that ended it.

    Args:
        function: Makes a run; the process imports it by its name.
        limits: What each run may use.
    """

    def __init__(self, function: RunFunction, limits: Limits):
        self._function, self._limits = function, limits
        self._spawn()

    def _spawn(self) -> None:
        self.connection, other_end = SPAWN.Pipe()
        self._process = SPAWN.Process(target=worker_main, args=(self._function, other_end))
        self._process.start()
        self._measured = psutil.Process(self._process.pid)
        other_end.close()
        self._is_ready, self._deadline = False, math.inf

    def start(self, run: Run) -> None:
        """Start a run; in a new process if the old one is gone or has kept too much memory."""
        self.run = run
        limit = self._limits.max_memory
        if not self._process.is_alive():
            self._spawn()
        elif limit is not None and self._megabytes() > IDLE_MEMORY_FRACTION * limit:
            self.kill()
            self._spawn()
        elif self._is_ready:
            try:
                self._send()
            except BrokenPipeError:  # it died after its last run
                self._spawn()

    def poll(self) -> Record | Failure | None:
        """Return what the run found, None while it continues. Never blocks."""
        try:
            if self.connection.poll():
                message = self.connection.recv()
                if message is not READY:
                    return message  # type: ignore[no-any-return]
                self._is_ready = True
                self._send()
        except (EOFError, OSError):
            self.kill()
            return Failure(self._cause_of_death())
        reason = self._exceeded()
        if reason is not None:
            self.kill()
            return Failure(reason)
        return None

    def seconds_to_wait(self) -> float | None:
        """Return after how long to poll again although the process has sent nothing; None for never."""
        left = max(0.0, self._deadline - time.monotonic())
        if self._limits.max_memory is not None:
            left = min(left, SECONDS_BETWEEN_POLLS)
        return None if math.isinf(left) else left

    def make(self, run: Run) -> Record | Failure:
        """Make one run and wait for its end."""
        self.start(run)
        while (found := self.poll()) is None:
            wait([self.connection], self.seconds_to_wait())
        return found

    def shutdown(self) -> None:
        """Let the idle process end by itself; kill it if it does not."""
        self.connection.close()
        self._process.join(SHUTDOWN_TIMEOUT)
        self.kill()

    def kill(self) -> None:
        """End the process and those that it started, whatever they do."""
        self.connection.close()
        with suppress(psutil.NoSuchProcess):  # it is gone already
            for process in [*self._measured.children(recursive=True), self._measured]:
                process.kill()
        self._process.join()

    def _send(self) -> None:
        seconds = self._limits.max_seconds
        self._deadline = math.inf if seconds is None else time.monotonic() + seconds
        self.connection.send(self.run)

    def _exceeded(self) -> str | None:
        """Return which limit the run exceeds, None for none."""
        if time.monotonic() >= self._deadline:
            return f"killed after {self._limits.max_seconds:g} s, the limit of one run"
        limit = self._limits.max_memory
        megabytes = 0.0 if limit is None else self._megabytes()
        if limit is not None and megabytes > limit:
            return f"killed at {megabytes:.0f} MB of memory; the limit of one run is {limit:g}"
        return None

    def _megabytes(self) -> float:
        try:
            return float(self._measured.memory_info().rss / 1e6)
        except psutil.NoSuchProcess:
            return 0.0

    def _cause_of_death(self) -> str:
        code = self._process.exitcode or 0
        cause = signal.strsignal(-code) if code < 0 else f"exit status {code}"
        guard = "" if self._is_ready else " (or a script without if __name__ == '__main__': around its calls)"
        return f"the process died, {cause}: a crash in C++, or out of memory{guard}"


def worker_main(function: RunFunction, connection: Connection) -> None:
    """Make each run that comes through `connection` and send back what it found, until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    threading.Thread(target=_end_with_parent, daemon=True).start()
    connection.send(READY)
    while True:
        try:
            run = connection.recv()
        except EOFError:
            return
        connection.send(_found(function, run))


def _found(function: RunFunction, run: Run) -> Record | Failure:
    """Return the record of a run, as it will be read from its file."""
    try:
        record: Record = json.loads(json.dumps(function(run), default=plain))
    except PbcsError as error:
        return Failure(str(error))
    except Exception as error:  # a mistake of a plug-in's author must not end the other runs
        return Failure(f"{type(error).__name__}: {error}")
    return record


def _end_with_parent() -> None:
    """End this process when its parent is gone, for whatever reason."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
