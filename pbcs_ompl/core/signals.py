"""Ctrl-C, and what stops a program in the same way: SIGTERM (Slurm, systemd, kill), SIGHUP (a terminal that closes)."""

import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""The signals that ask a program to stop; Windows has no SIGHUP."""
MOMENT = 0.02
"""Seconds after which a signal that Python had to drop is raised again."""


class Interrupted(KeyboardInterrupt):
    """A signal other than Ctrl-C asked the program to stop.

    Attributes:
        number: The signal.
    """

    def __init__(self, message: str = "", number: int = signal.SIGTERM):
        super().__init__(message)
        self.number = number


def interruption(number: int, message: str = "") -> KeyboardInterrupt:
    """Return the exception that stands for a signal."""
    return KeyboardInterrupt(message) if number == signal.SIGINT else Interrupted(message, number)


def with_remedy(error: KeyboardInterrupt, remedy: str) -> KeyboardInterrupt:
    """Return the same interruption with the words that say how to go on."""
    return interruption(signal_of(error), remedy)


def signal_of(error: KeyboardInterrupt) -> int:
    """Return the signal that an exception stands for."""
    return error.number if isinstance(error, Interrupted) else signal.SIGINT


def _raise(number: int, frame: Any) -> None:
    raise interruption(number)


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Let SIGTERM and SIGHUP raise `Interrupted` wherever the program happens to be, as Ctrl-C does.

    A signal that is ignored (`nohup`) or has a handler stays as it is. In a callback of C, as those of LLVM while it
    compiles, and in `__del__`, Python drops what is raised: then the signal comes again a moment later, Ctrl-C too.
    """
    with _handled(_raise, (signal.SIG_DFL,)), _dropped_ones_again():
        yield


@contextmanager
def interruptible(on_interrupt: Callable[[KeyboardInterrupt], None]) -> Iterator[None]:
    """Call `on_interrupt` at the first signal that asks to stop, instead of raising wherever the program happens to be.

    A planner must not be left through OMPL's C++, a training only between two of its steps. A second signal raises at
    once. Handlers that a host application has set, and other threads, are left alone.

    Args:
        on_interrupt: Gets the exception to raise at the next good place.
    """
    seen: list[int] = []

    def stop_once(number: int, frame: Any) -> None:
        if seen:
            raise interruption(number)
        seen.append(number)
        on_interrupt(interruption(number))

    with _handled(stop_once, (signal.SIG_DFL, signal.default_int_handler, _raise)):
        yield


@contextmanager
def _dropped_ones_again() -> Iterator[None]:
    """Let a signal come again when the exception that it raised was dropped; others that are dropped are reported."""
    before = sys.unraisablehook

    def hook(dropped: Any) -> None:
        if isinstance(dropped.exc_value, KeyboardInterrupt):
            again = threading.Timer(MOMENT, interrupt_main, (signal_of(dropped.exc_value),))
            again.daemon = True
            again.start()
        else:
            before(dropped)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextmanager
def _handled(handler: Callable[[int, Any], None], replaced: tuple[Any, ...]) -> Iterator[None]:
    """Set a handler for the signals that have one of the handlers `replaced`; in the main thread only."""
    usual: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        usual = {number: before for number in STOPPING if (before := signal.getsignal(number)) in replaced}
    for number in usual:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, before in usual.items():
            signal.signal(number, before)
