"""What a new process needs: a script that it can import, and a parent with which it ends."""

import ctypes
import os
import signal
import sys
import threading
from multiprocessing import parent_process

from pbcs_ompl.core.errors import PbcsError

PR_SET_PDEATHSIG = 1
GUARD = "if __name__ == '__main__':"


class CannotStart(PbcsError):
    """No process can be started, so nothing was run; that says nothing about what was to be run."""


def check_script() -> None:
    """Refuse to start processes that could not import the running script, which each of them does first.

    Raises:
        CannotStart: the script has no file, as one that is read from the standard input.
    """
    main = sys.modules["__main__"]
    file = getattr(main, "__file__", None)
    if file is not None and getattr(main, "__spec__", None) is None and not os.path.isfile(file):
        raise CannotStart(f"cannot start workers: the running script {file!r} is no file that they could import; save "
                          f"it as one, with its calls below {GUARD}")


def end_with_parent() -> None:
    """End this process when its parent is gone, for whatever reason and whatever this process does then."""
    parent = parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)  # compiled code may keep a thread from running
    threading.Thread(target=_wait_for_end, daemon=True).start()


def _wait_for_end() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
