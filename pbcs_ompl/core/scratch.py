"""A folder for caches where neither the installation nor the home can be written."""

import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path


def scratch_folder() -> Path:
    """Return a folder of this user that no other user can write: the same each time, so that caches are of use.

    What lies in it is executed, so one that another user has made is not used.

    Raises:
        OSError: there is no folder for temporary files that can be written.
    """
    path = Path(tempfile.gettempdir()) / f"pbcs-ompl-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    with suppress(FileExistsError):
        path.mkdir(mode=0o700)
    return path if _is_ours(path) else Path(tempfile.mkdtemp(prefix="pbcs-ompl-"))


def can_be_written(folder: Path) -> bool:
    """Return whether a file can be made in a folder, which is made too if it has to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _is_ours(path: Path) -> bool:
    found = path.lstat()
    ours = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o077)
    return stat.S_ISDIR(found.st_mode) and ours and can_be_written(path)
