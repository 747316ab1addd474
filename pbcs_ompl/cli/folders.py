"""Where results go when the user does not say, and whether those that the user names are there."""

from itertools import chain, count
from pathlib import Path

from pbcs_ompl.core.errors import RunFolderError, did_you_mean


def check_exists(folder: str | Path) -> None:
    """Refuse a path to a folder that does not exist; a name alone may be that of something in the package.

    Raises:
        RunFolderError: it does not exist; the closest one is suggested.
    """
    path = Path(folder)
    if path.name != str(path) and not path.exists():
        beside = [str(other) for other in path.parent.iterdir() if other.is_dir()] if path.parent.is_dir() else []
        raise RunFolderError(f"{path} does not exist{did_you_mean(str(path), beside)}")


def fresh_folder(*words: object) -> Path:
    """Return runs/<words joined by hyphens>, with the next free number behind it when that one exists."""
    name = "-".join(str(word).rpartition("/")[2].replace(":", ".") for word in words)
    candidates = chain([name], (f"{name}-{number}" for number in count(2)))
    folders = (Path("runs") / candidate for candidate in candidates)
    return next(folder for folder in folders if not folder.exists())
