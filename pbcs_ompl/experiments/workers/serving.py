"""What a worker process does: make the runs it is sent, one after the other."""

import os
import signal
import threading
from collections.abc import Callable
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

READY = None
"""The first message of a worker: it has imported what its runs need."""


class Ended(NamedTuple):
    """How a run ended: with a record, or with the reason why there is none."""

    record: Any = None
    reason: str | None = None


def serve(run: Callable[[Any], Any], connection: Connection) -> None:
    """Answer each job that comes through `connection` with an `Ended`, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    threading.Thread(target=_follow_parent, daemon=True).start()
    connection.send(READY)
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        try:
            connection.send(Ended(run(job)))
        except Exception as error:  # a mistake of a plug-in's author: the other runs go on
            connection.send(Ended(reason=f"{type(error).__name__}: {error}"))


def _follow_parent() -> None:
    """End this process when its parent is gone, however it went."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
