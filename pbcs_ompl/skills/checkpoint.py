"""Write and read the state of a training, so that it can stop at any moment."""

import json
from pathlib import Path

import numpy as np

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.plain import plain
from pbcs_ompl.results.files import read_arrays, write_arrays
from pbcs_ompl.skills.method import Snapshot

VERSION = 2


def write_checkpoint(path: Path, snapshot: Snapshot, seconds: float) -> None:
    """Write a snapshot and the seconds of training so far, atomically."""
    words = json.dumps({"version": VERSION, "seconds": seconds, "plain": snapshot.plain}, default=plain)
    write_arrays(path, __words__=np.array(words), **snapshot.arrays)


def read_checkpoint(path: Path) -> tuple[Snapshot, float]:
    """Return the snapshot and the seconds of training before it.

    Raises:
        DamagedFile: the file is missing, truncated, or of another version.
    """
    arrays = read_arrays(path)
    try:
        words = json.loads(str(arrays.pop("__words__")))
        version = words["version"]
    except (KeyError, ValueError) as error:
        raise DamagedFile(f"{path} is no checkpoint: {error}") from error
    if version != VERSION:
        raise DamagedFile(f"{path} has version {version}, expected {VERSION}; train anew")
    return Snapshot(words["plain"], arrays), words["seconds"]
