"""Where results go when the user does not say."""

from itertools import chain, count
from pathlib import Path


def fresh_folder(*words: object) -> Path:
    """Return runs/<words joined by hyphens>, with the next free number behind it when that one exists."""
    name = "-".join(str(word).rpartition("/")[2].replace(":", ".") for word in words)
    candidates = chain([name], (f"{name}-{number}" for number in count(2)))
    folders = (Path("runs") / candidate for candidate in candidates)
    return next(folder for folder in folders if not folder.exists())
