"""A result folder: never overwritten silently, never half-written, used by one process (or by parts of one run)."""

import errno
import json
import os
import tomllib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from secrets import token_hex
from typing import IO, Any

import numpy as np

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.core.plain import plain
from pbcs_ompl.results.lock import FolderLock
from pbcs_ompl.results.provenance import provenance

CONFIG = "config.toml"
RESULT = "result.json"
PROVENANCE = "provenance.json"
LOCK = ".lock"


class RunFolder:
    """A folder that one run writes, locked while it does.

    Args:
        path: The folder; it is created.
        resume: Continue in a folder that already holds a run instead of refusing it.
        part: The name of the part of a run that this process makes; others may make other parts at the same time.

    Raises:
        RunFolderError: the folder holds something, is in use, or cannot be written.
    """

    def __init__(self, path: str | Path, *, resume: bool = False, part: str = ""):
        self.path = Path(path)
        if resume and not (self.path / CONFIG).is_file():
            raise RunFolderError(f"nothing to resume: {self.path / CONFIG} does not exist")
        leftovers = (LOCK, f".{CONFIG}.")  # of a process that was killed before it began
        if not resume and self.path.is_dir() and any(not p.name.startswith(leftovers) for p in self.path.iterdir()):
            raise RunFolderError(f"{self.path} already exists; choose another --out, or remove it first")
        with clear_write_errors(self.path), ExitStack() as locks:
            self.path.mkdir(parents=True, exist_ok=True)
            locks.enter_context(FolderLock(self.path / LOCK, shared=bool(part)))
            if part:
                locks.enter_context(FolderLock(self.path / f"{LOCK}-{part}"))
            self._locks = locks.pop_all()
        if resume:
            self._note_provenance()

    def __enter__(self) -> "RunFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock and remove its file."""
        self._locks.close()

    def write_config(self, config: dict[str, Any]) -> None:
        """Write the settings that repeat this run, and with which versions and on which machine it is made."""
        write_text(self.path / CONFIG, to_toml(config))
        self._note_provenance()

    def _note_provenance(self) -> None:
        """Add this process to those that worked here, unless one like it did."""
        path = self.path / PROVENANCE
        before = read_json(path) if path.is_file() else []
        if provenance() not in before:
            write_json(path, [*before, provenance()])

    def write_result(self, result: dict[str, Any]) -> None:
        """Write the answer as JSON."""
        write_json(self.path / RESULT, result)


def open_run(path: Path, config: dict[str, Any], *, may_change: tuple[str, ...] = (), part: str = "") -> RunFolder:
    """Open a new folder for a run with these settings, or go on in the one where the same run was stopped.

    Args:
        may_change: Settings that may differ from those of the run that was stopped; the folder keeps the new ones.
        part: The name of the part of the run that this process makes; see `RunFolder`.

    Raises:
        RunFolderError: the folder holds something else or a run with other settings, is in use, or cannot be written.
    """
    with clear_write_errors(path):
        path.mkdir(parents=True, exist_ok=True)
        with FolderLock(path / f"{LOCK}-opening", wait=True):  # parts that begin at the same time, one after the other
            return _open_run(path, config, may_change, part)


def _open_run(path: Path, config: dict[str, Any], may_change: tuple[str, ...], part: str) -> RunFolder:
    if not (path / CONFIG).is_file():
        opened = RunFolder(path, part=part)
        opened.write_config(config)
        return opened
    before, now = read_toml(path / CONFIG), tomllib.loads(to_toml(config))
    different = sorted(key for key in before.keys() | now.keys() if before.get(key) != now.get(key))
    forbidden = [key for key in different if key not in may_change]
    if forbidden:
        raise RunFolderError(f"{path} holds another run ({', '.join(forbidden)}); choose another --out")
    opened = RunFolder(path, resume=True, part=part)
    if different:
        opened.write_config(config)
    return opened


@contextmanager
def clear_write_errors(path: Path) -> Iterator[None]:
    """Turn an OSError while writing below `path` into one clear line."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise RunFolderError(f"the disk is full: could not write {path}; free some space and resume") from error
        raise RunFolderError(f"cannot write {path}: {error.strerror or error}") from error


def write_atomically(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write a file under a temporary name, flush it to disk, then rename it: it is whole or absent."""
    with clear_write_errors(path):
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


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    write_atomically(path, lambda file: file.write(text.encode()))


def write_json(path: Path, value: Any) -> None:
    """Write JSON atomically; NumPy numbers and arrays become plain ones."""
    write_text(path, json.dumps(value, indent=2, default=plain) + "\n")


def write_arrays(path: Path, **arrays: np.ndarray) -> None:
    """Write arrays as one compressed npz, atomically."""
    write_atomically(path, lambda file: np.savez_compressed(file, allow_pickle=False, **arrays))


def read_json(path: Path) -> Any:
    """Read JSON.

    Raises:
        DamagedFile: the file is missing, truncated or not JSON.
    """
    try:
        return json.loads(Path(path).read_text())
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except (OSError, ValueError) as error:
        raise DamagedFile(f"{path} is damaged: {error}") from error


def read_toml(path: Path) -> dict[str, Any]:
    """Read TOML.

    Raises:
        DamagedFile: the file is missing or does not parse.
    """
    try:
        return tomllib.loads(Path(path).read_text())
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except (OSError, ValueError) as error:
        raise DamagedFile(f"{path} is damaged: {error}") from error


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read all arrays of an npz, without pickle.

    Raises:
        DamagedFile: the file is missing or truncated.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except Exception as error:  # zipfile, zlib, ValueError, EOFError: all mean the same to the user
        raise DamagedFile(f"{path} is damaged: {error}") from error


def to_toml(config: dict[str, Any]) -> str:
    """Write a flat table, with sub-tables one level deep, as TOML. Values that are None are left out."""
    flat = {key: value for key, value in config.items() if not isinstance(value, dict)}
    tables = {key: value for key, value in config.items() if isinstance(value, dict)}
    lines = [f"{key} = {_toml_value(value)}" for key, value in flat.items() if value is not None]
    for name, table in tables.items():
        lines += ["", f"[{name}]"]
        lines += [f"{_toml_string(key)} = {_toml_value(value)}" for key, value in table.items() if value is not None]
    return "\n".join(lines) + "\n"


def _toml_value(value: Any) -> str:
    value = plain(value) if isinstance(value, np.ndarray | np.generic | Path) else value
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml_string(k)} = {_toml_value(v)}" for k, v in value.items() if v is not None) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    if isinstance(value, float) and not np.isfinite(value):
        return "nan" if np.isnan(value) else ("inf" if value > 0 else "-inf")
    return _toml_string(value) if isinstance(value, str) else json.dumps(value)


def _toml_string(text: str) -> str:
    """Quote as JSON does, without the surrogate pairs and with the one control character that TOML wants escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
