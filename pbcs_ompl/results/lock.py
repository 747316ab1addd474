"""Lock files: held by one process or shared by several, and let go by the system when these end, however they do."""

import fcntl
import os
from contextlib import suppress
from pathlib import Path

from pbcs_ompl.core.errors import RunFolderError


class FolderLock:
    """A lock on a folder, by a file in it that is there as long as somebody holds it.

    Args:
        path: The file.
        shared: Others may hold it at the same time, if they share it too.
        wait: Wait until it can be had.

    Raises:
        RunFolderError: others hold it.
        OSError: the file cannot be written, or its disk knows no locks.
    """

    def __init__(self, path: Path, *, shared: bool = False, wait: bool = False):
        self._path = path
        how = (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB)
        while True:
            self._file = open(path, "a+")  # noqa: SIM115 - held for its life; NFS shares locks of readers only
            try:
                fcntl.flock(self._file, how)
            except BlockingIOError as error:
                self._file.close()
                raise RunFolderError(f"{path.parent} is in use by another process; wait for its end, or choose "
                                     "another --out") from error
            if self._is_there():
                break
            self._file.close()

    def __enter__(self) -> "FolderLock":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go, and remove the file if nobody else holds it."""
        if self._file.closed:
            return
        with suppress(BlockingIOError):
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._path.unlink(missing_ok=True)
        self._file.close()

    def _is_there(self) -> bool:
        """Return whether the file is still the one of this name: who held it before may have removed it."""
        with suppress(FileNotFoundError):
            return os.path.samestat(os.fstat(self._file.fileno()), os.stat(self._path))
        return False
