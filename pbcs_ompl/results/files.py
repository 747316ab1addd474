"""Files of result folders: their names, and reading and writing them. A file that is written is whole or absent."""

import errno
import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex
from typing import IO, Any, TypeVar

import numpy as np
import tomli_w
from numpy.typing import NDArray

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.utf8 import utf8

CONFIG, RESULT, PROVENANCE = "config.toml", "result.json", "provenance.json"
"""Every folder: the settings that repeat the run, what it found, with which versions and machines."""
TRAJECTORY, TREE = "trajectory.npz", "tree.npz"
"""pbcs plan: the path to the goal, and all states that were visited."""
PLAN, CHECKPOINT, CHAIN = "plan.json", "checkpoint.npz", "chain"
"""pbcs train: the effort of planning, what --resume needs, and the folder of the skill chain."""
RUNS, FIGURES = "runs", "figures"
"""pbcs compare and pbcs study: the folders of the records, and of the pictures of a study."""
Content = TypeVar("Content")


@contextmanager
def write_errors(path: Path) -> Iterator[None]:
    """Turn an OSError while writing below `path`, or a name that no file has, into a RunFolderError of one line."""
    try:
        if b"\0" in os.fsencode(path):
            raise RunFolderError(f"{str(path)!a} is no name of a file: it holds a null byte")
        yield
    except UnicodeEncodeError as error:
        raise RunFolderError(f"{str(path)!a} is no name of a file: {error.reason}") from error
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise RunFolderError(f"the disk is full: could not write {path}; free some space and resume") from error
        raise RunFolderError(f"cannot write {path}: {error.strerror or error}") from error


def write_atomically(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write a file under a temporary name, flush it to disk, then rename it.

    Raises:
        RunFolderError: it cannot be written.
    """
    with write_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{token_hex(4)}")  # tempfile would hide it from all other users
        try:
            with open(temporary, "xb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise


TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}")
"""The names of the files that `write_atomically` renames at its end."""


def sweep_temporaries(folder: Path) -> None:
    """Remove what processes that were killed while they wrote have left in a folder and those below it."""
    for place, _, names in os.walk(folder):
        for name in filter(TEMPORARY.fullmatch, names):
            (Path(place) / name).unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    content = utf8(text)
    write_atomically(path, lambda file: file.write(content))


def write_json(path: Path, value: Any) -> None:
    """Write JSON atomically; NumPy numbers and arrays become plain ones."""
    write_text(path, json.dumps(value, indent=2, default=plain) + "\n")


def write_toml(path: Path, table: dict[str, Any]) -> None:
    """Write TOML atomically; see `to_toml`."""
    write_text(path, to_toml(table))


def write_arrays(path: Path, **arrays: NDArray[Any]) -> None:
    """Write arrays as one compressed npz, atomically."""
    write_atomically(path, lambda file: np.savez_compressed(file, allow_pickle=False, **arrays))


def read_json(path: Path) -> Any:
    """Read JSON.

    Raises:
        DamagedFile: the file is missing, truncated or not JSON.
    """
    return _read(path, lambda: json.loads(path.read_text("utf-8")), OSError, ValueError)


def read_toml(path: Path) -> dict[str, Any]:
    """Read TOML.

    Raises:
        DamagedFile: the file is missing or does not parse.
    """
    return _read(path, lambda: tomllib.loads(path.read_text("utf-8")), OSError, ValueError)


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read all arrays of an npz, without pickle.

    Raises:
        DamagedFile: the file is missing or truncated.
    """
    def load() -> dict[str, NDArray[Any]]:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}

    return _read(path, load, Exception)  # zipfile, zlib, ValueError, EOFError: all mean the same to the user


def _read(path: Path, load: Callable[[], Content], *damage: type[Exception]) -> Content:
    try:
        return load()
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except damage as error:
        raise DamagedFile(f"{path} is damaged: {error}") from error


def to_toml(table: dict[str, Any]) -> str:
    """Return a table as TOML. Values that are None are left out; NumPy values and paths become plain ones."""
    return tomli_w.dumps(_for_toml(table))


def _for_toml(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _for_toml(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [_for_toml(item) for item in value]
    return value if isinstance(value, str | bool | int | float) and not isinstance(value, np.generic) else plain(value)
