"""A worker process: it makes one run after another; its parent watches it, and kills it when it exceeds a limit."""

import json
import math
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any

import psutil

from pbcs_ompl.core.callbacks import describe
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.signals import STOPPING
from pbcs_ompl.experiments.run import Failure, Record, Run, RunFunction
from pbcs_ompl.experiments.workers.start import GUARD, CannotStart, end_with_parent

SECONDS_BETWEEN_POLLS = 0.1
"""How often the memory of a worker is measured; the system does not report when it grows."""
IDLE_MEMORY_FRACTION = 0.5
"""A worker that holds more than this share of its limit between two runs is replaced: each run has the rest of it."""
LONGEST_WAIT = 86_400.0
"""Seconds; the system knows no timeout as long as a limit may be."""
SHUTDOWN_TIMEOUT = 5.0
"""Seconds within which an idle process has to end by itself."""
READY = "ready"
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
        self._process = SPAWN.Process(target=worker_main, args=(other_end,))
        self._process.start()
        self._measured = psutil.Process(self._process.pid)
        other_end.close()
        self._is_ready, self._deadline = False, math.inf
        with suppress(BrokenPipeError):  # `poll` finds that it died
            self.connection.send(self._function)

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
        """Return what the run found, None while it continues. Never blocks.

        Raises:
            CannotStart: the process ended before it was ready for any run.
        """
        try:
            if self.connection.poll():
                message: Any = self.connection.recv()
                if self._is_ready:
                    return message  # type: ignore[no-any-return]
                if message != READY:
                    raise CannotStart(f"cannot start workers: {message}")
                self._is_ready = True
                self._send()
        except (EOFError, OSError):
            self.kill()
            if not self._is_ready:
                raise CannotStart(f"cannot start workers: {self._cause_of_death()}, before it was ready for a run "
                                  f"(does the script have its calls below {GUARD}?)") from None
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
        return None if math.isinf(left) else min(left, LONGEST_WAIT)

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
        return f"the process died, {cause}: a crash in C++, or out of memory"


def worker_main(connection: Connection) -> None:
    """Make each run that comes through `connection` and send back what it found, until the connection is closed.

    First comes the function that makes them: what it imports takes seconds.
    """
    end_with_parent()
    for number in STOPPING:
        signal.signal(number, signal.SIG_IGN)  # they are for the parent, which ends its workers
    with suppress(EOFError, ConnectionError):  # closed, or closed while the parent was stopped
        _serve(connection)


def _serve(connection: Connection) -> None:
    try:
        function = connection.recv()
    except (EOFError, ConnectionError):
        raise
    except (Exception, SystemExit) as error:
        connection.send(describe(error))
        return
    connection.send(READY)
    while True:
        connection.send(_found(function, connection.recv()))


def _found(function: RunFunction, run: Run) -> Record | Failure:
    """Return the record of a run, as it will be read from its file."""
    try:
        record: Record = json.loads(json.dumps(function(run), default=plain))
    except PbcsError as error:
        return Failure(str(error))
    except Exception as error:  # a mistake of a plug-in's author must not end the other runs
        return Failure(describe(error))
    return record
