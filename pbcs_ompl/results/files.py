"""Files of result folders: their names, and reading and writing them. A file that is written is whole or absent."""

import errno
import io
import json
import os
import re
import stat
import zipfile
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
from pbcs_ompl.core.text_values import parse_json, parse_toml
from pbcs_ompl.core.utf8 import utf8
from pbcs_ompl.results.schema import check

CONFIG, RESULT, PROVENANCE = "config.toml", "result.json", "provenance.json"
"""Every folder: the settings that repeat the run, what it found, with which versions and machines."""
TRAJECTORY, TREE = "trajectory.npz", "tree.npz"
"""pbcs plan: the path to the goal, and all states that were visited."""
PLAN, CHECKPOINT, CHAIN, FOLLOWER = "plan.json", "checkpoint.npz", "chain", "follower"
"""pbcs train: the effort of planning, what --resume needs, and the folder of the skill chain, or of the follower."""
RUNS, FIGURES = "runs", "figures"
"""pbcs compare and pbcs study: the folders of the records, and of the pictures of a study."""
Content = TypeVar("Content")
VIEW = "view.html"
"""pbcs view: tree, plan and controller in three dimensions."""
HEAD_BYTES = 1024
MOST_BYTES, MOST_ARRAY_BYTES, MOST_ARRAYS = 1 << 28, 1 << 33, 100_000
"""What is read of one file, so that a small file of another person does not fill the memory."""


def check_replaceable(page: Path, mark: str, maker: str) -> None:
    """Refuse to replace a file that is not an older page of ours.

    Args:
        page: What is to be written.
        mark: What the first `HEAD_BYTES` of a page of ours hold.
        maker: The command that writes such pages, for the message.

    Raises:
        RunFolderError: there is something else.
    """
    if page.is_dir():
        raise RunFolderError(f"cannot write {page}: it is a folder; name a file")
    if page.exists() and not page.is_file():
        raise RunFolderError(f"cannot write {page}: it is no regular file; choose another --out")
    if page.exists():
        with open(page, "rb") as file:
            if mark.encode() not in file.read(HEAD_BYTES):
                raise RunFolderError(f"{page} was not written by {maker}; choose another --out, or remove it first")


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


TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}(-journal)?")
"""The names of the files that `write_atomically` renames at its end, and of what SQLite writes beside one."""


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
    write_text(path, to_json(value))


def write_toml(path: Path, table: dict[str, Any]) -> None:
    """Write TOML atomically; see `to_toml`."""
    write_text(path, to_toml(table))


def write_arrays(path: Path, **arrays: NDArray[Any]) -> None:
    """Write arrays as one compressed npz, atomically."""
    write_atomically(path, lambda file: np.savez_compressed(file, allow_pickle=False, **arrays))


def is_there(path: Path) -> bool:
    """Return whether there is a file of this name, even a broken link or a pipe: reading it says what is wrong."""
    return os.path.lexists(path)


def read_json(path: Path, kind: Any = Any, *, finite: bool = True) -> Any:
    """Read JSON.

    Args:
        path: The file.
        kind: What it should hold: a type of `results.schema`; anything by default.
        finite: Whether NaN and Infinity are refused.

    Raises:
        DamagedFile: the file is missing, truncated, not JSON, or holds something else than `kind`.
    """
    value = _read(path, lambda: parse_json(read_bytes(path).decode("utf-8"), finite=finite))
    check(path, value, kind)
    return value


def read_toml(path: Path, kind: Any = dict[str, Any]) -> dict[str, Any]:
    """Read TOML.

    Args:
        path: The file.
        kind: What it should hold: a type of `results.schema`; anything by default.

    Raises:
        DamagedFile: the file is missing, does not parse, or holds something else than `kind`.
    """
    table = _read(path, lambda: parse_toml(read_bytes(path).decode("utf-8")))
    check(path, table, kind)
    return table


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read all arrays of an npz, without pickle; each is read to its end, where its checksum is compared.

    Raises:
        DamagedFile: the file is missing, truncated, or so large that it can only be a trap.
    """
    return _read(path, lambda: _arrays(path))


def read_bytes(path: Path) -> bytes:
    """Read a file that has to be a regular one: a pipe would wait for ever.

    Raises:
        OSError: it cannot be read.
        ValueError: it is something else, or too large.
    """
    _check_regular(path, MOST_BYTES)
    return path.read_bytes()


def _check_regular(path: Path, most: int) -> None:
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("it is no regular file")
    if status.st_size > most:
        raise ValueError(f"it has {status.st_size:,} bytes; expected at most {most:,}")


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    _check_regular(path, MOST_ARRAY_BYTES)
    with zipfile.ZipFile(path) as file:
        members = file.infolist()
        size = sum(member.file_size for member in members)
        if size > MOST_ARRAY_BYTES or len(members) > MOST_ARRAYS:
            raise ValueError(f"{len(members):,} arrays of {size:,} bytes; expected at most {MOST_ARRAYS:,} of "
                             f"{MOST_ARRAY_BYTES:,}")
        arrays = {member.filename.removesuffix(".npy"): _array(file, member) for member in members}
    if len(arrays) < len(members):
        raise ValueError("an array is there twice")
    return arrays


def _array(file: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    content = io.BytesIO(file.read(member))  # zipfile compares the checksum at the end only
    array = np.lib.format.read_array(content, allow_pickle=False)
    if content.read(1):
        raise ValueError(f"{member.filename} has bytes behind its array")
    return array


def _read(path: Path, load: Callable[[], Content]) -> Content:
    try:
        return load()
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except Exception as error:  # zipfile, zlib, ValueError, EOFError, OSError: all mean the same to the user
        raise DamagedFile(f"{path} is damaged: {error}") from error


def to_json(value: Any) -> str:
    """Return a value as JSON; NumPy values and paths become plain ones."""
    return json.dumps(value, indent=2, default=plain, ensure_ascii=False) + "\n"


def to_toml(table: dict[str, Any]) -> str:
    """Return a table as TOML. Values that are None are left out; NumPy values and paths become plain ones."""
    return tomli_w.dumps(_for_toml(table))


def _for_toml(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _for_toml(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [_for_toml(item) for item in value]
    return value if isinstance(value, str | bool | int | float) and not isinstance(value, np.generic) else plain(value)
