"""The lock of a folder: a file that one process holds, and that the system releases when this process ends."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from pbcs_ompl.core.errors import RunFolderError

POLL_SECONDS = 0.01


@contextmanager
def lock(path: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold a lock file, which exists as long as it is held.

    Args:
        path: The file.
        wait: Wait until no other process holds it.

    Raises:
        RunFolderError: another process holds it.
        OSError: the file cannot be written, or its disk supports no locks.
    """
    file = FileLock(path, thread_local=False, poll_interval=POLL_SECONDS, fallback_to_soft=False)
    try:
        file.acquire(timeout=-1 if wait else 0)
    except Timeout as error:
        raise RunFolderError(f"{path.parent} is in use by another process; wait until it ends, or choose another "
                             "--out") from error
    try:
        yield
    finally:
        path.unlink(missing_ok=True)  # before the release: FileLock refuses a file that was removed meanwhile
        file.release()
