"""Says on the standard error what a command is busy with, if it takes long."""

import sys
import threading
from types import TracebackType
from typing import Self

EVERY = 3.0
"""Seconds between two lines."""


class Busy:
    """Prints every few seconds what it does; `stage` says what begins.

    Args:
        command: The command, as its user knows it.
    """

    def __init__(self, command: str):
        self._command, self._stage = command, "starting"
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, name="busy", daemon=True)

    def stage(self, name: str) -> None:
        """Begin something of that name."""
        self._stage = name

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self._done.set()
        self._thread.join()

    def _run(self) -> None:
        seconds = 0.0
        while not self._done.wait(EVERY):
            seconds += EVERY
            print(f"{self._command}: {seconds:.0f} s, busy with: {self._stage}", file=sys.stderr, flush=True)
