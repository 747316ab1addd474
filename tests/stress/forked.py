"""Calls in forked children of a process that has imported everything: thousands cost no more than their own time."""

import contextlib
import os
import resource
import select
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import NamedTuple

from pbcs_ompl.core.errors import PbcsError

MEGABYTES = 6000
"""Of address space beyond what the parent has: what asks for more gets a MemoryError, not the machine's memory."""


class Ended(NamedTuple):
    """How a call ended: its exit status, negative for a signal; what it printed, tracebacks among it."""

    status: int
    text: str


NAMED, RAW = 0, 97


def call(function, *, seconds=30.0, folder=None):
    """Call a function in a child; its status is what the function returns, or `RAW` after an exception."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        _child(function, write, seconds, folder)
    os.close(write)
    text = _read_until(read, child, time.monotonic() + seconds + 5)
    os.close(read)
    return Ended(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text.decode("utf-8", "replace"))


def _read_until(read, child, deadline):
    text = b""
    while (left := deadline - time.monotonic()) > 0:
        if select.select([read], [], [], left)[0]:
            part = os.read(read, 1 << 16)
            if not part:
                return text
            text += part
    os.kill(child, signal.SIGKILL)
    return text


def _child(function, write, seconds, folder):
    status = RAW
    try:
        os.dup2(write, 1)
        os.dup2(write, 2)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", errors="backslashreplace") for number in (1, 2))
        signal.signal(signal.SIGALRM, signal.SIG_DFL)  # in place of that of pytest-timeout
        signal.alarm(int(seconds) + 1)
        used = int(Path("/proc/self/statm").read_text("utf-8").split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEGABYTES * 10**6,) * 2)
        if folder is not None:
            os.chdir(folder)
        status = function()
    except BaseException:
        with contextlib.suppress(BaseException):
            traceback.print_exc()
    finally:
        with contextlib.suppress(BaseException):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status if 0 <= status < 256 else RAW)


def named(function):
    """Return a function that calls `function` and passes on all exceptions but our own, which it prints."""
    def run():
        try:
            function()
        except PbcsError as error:
            print(f"{type(error).__name__}: {error}")
        return NAMED

    return run
