"""A result folder: never overwritten silently, never half-written, used by one process (or by shards of one run)."""

import os
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.results.checksums import SUMS, write_summed_json, write_summed_toml
from pbcs_ompl.results.files import (
    CONFIG,
    PROVENANCE,
    RESULT,
    is_there,
    read_json,
    read_toml,
    sweep_temporaries,
    to_toml,
    write_errors,
)
from pbcs_ompl.results.provenance import provenance
from pbcs_ompl.results.schema import CONFIGS, RESULTS, Provenance, check

KINDS = tuple(CONFIGS)
"""What a folder may hold: the `kind` of its config.toml."""
LOCK = ".lock"


class RunFolder:
    """A folder that one run writes, locked while it does.

    Args:
        path: The folder; it is created.
        resume: Continue in a folder that already holds a run instead of refusing it.
        shard: The name of the shard that this process makes; others may make other shards at the same time.

    Raises:
        RunFolderError: the folder holds something, is in use, or cannot be written.
    """

    def __init__(self, path: str | Path, *, resume: bool = False, shard: str = ""):
        self.path = Path(path)
        with write_errors(self.path):
            self._check(resume)
            self.path.mkdir(parents=True, exist_ok=True)
            self._locks = _locked(self.path, shard)
            if not shard:  # other shards may be writing
                sweep_temporaries(self.path)
        if resume:
            self._note_provenance()

    def _check(self, resume: bool) -> None:
        if resume and not (self.path / CONFIG).is_file():
            raise RunFolderError(f"nothing to resume: {self.path / CONFIG} does not exist")
        leftovers = (LOCK, SUMS, f".{CONFIG}.")  # of a process that was killed before it wrote its settings
        if not resume and self.path.is_dir() and any(not p.name.startswith(leftovers) for p in self.path.iterdir()):
            raise RunFolderError(f"{self.path} already exists; choose another --out, or remove it first")

    def __enter__(self) -> "RunFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock and remove its file."""
        self._locks.close()

    def write_config(self, config: dict[str, Any]) -> None:
        """Write the settings that repeat this run, and with which versions and on which machine it is made.

        Args:
            config: Plain values, among them `kind`, one of `KINDS`.
        """
        write_summed_toml(self.path / CONFIG, config)
        self._note_provenance()

    def _note_provenance(self) -> None:
        """Add this process to those that worked here, unless one with the same versions and machine did."""
        path = self.path / PROVENANCE
        before = read_json(path, Provenance) if is_there(path) else []
        if provenance() not in before:
            write_summed_json(path, [*before, provenance()])

    def write_result(self, result: dict[str, Any]) -> None:
        """Write what the run found, as JSON."""
        write_summed_json(self.path / RESULT, result)


def _locked(path: Path, shard: str) -> ExitStack:
    """Lock a folder, or one shard of it. The whole excludes all shards, and each shard the whole and itself."""
    with ExitStack() as locks:
        locks.enter_context(lock(path / (f"{LOCK}-shard-{shard}" if shard else LOCK)))
        for other in [path / LOCK] if shard else path.glob(f"{LOCK}-shard-*"):
            with lock(other):  # raises where it is held
                pass
        return locks.pop_all()


def start_run(path: Path, config: dict[str, Any], *, may_change: tuple[str, ...], parts: tuple[str, ...]) -> RunFolder:
    """Open a new folder, or the one in which a run with the same settings was killed before it had a result.

    Args:
        path: The folder.
        config: The settings; see `RunFolder.write_config`.
        may_change: Settings in which equal runs may differ.
        parts: The files of such a run, which are removed: it is made again.

    Raises:
        RunFolderError: the folder holds something else, is in use, or cannot be written.
    """
    killed = _was_killed(path, config, may_change)
    opened = RunFolder(path, resume=killed)
    for part in parts if killed else ():
        (path / part).unlink(missing_ok=True)
    opened.write_config(config)
    return opened


def _was_killed(path: Path, config: dict[str, Any], may_change: tuple[str, ...]) -> bool:
    with write_errors(path):
        if not (path / CONFIG).is_file() or (path / RESULT).exists():
            return False
    return not set(_different(path, config)) - set(may_change)


def _different(path: Path, config: dict[str, Any]) -> list[str]:
    """Return the settings that are not those in a folder."""
    before, now = read_toml(path / CONFIG), tomllib.loads(to_toml(config))
    return sorted(key for key in before.keys() | now.keys() if before.get(key) != now.get(key))


def open_run(path: Path, config: dict[str, Any], *, may_change: tuple[str, ...] = (), shard: str = "") -> RunFolder:
    """Open a new folder for a run with these settings, or resume in the one where the same run was stopped.

    Args:
        path: The folder.
        config: The settings; see `RunFolder.write_config`.
        may_change: Settings that may differ from those of the run that was stopped; the folder keeps the new ones.
        shard: The name of the shard that this process makes; see `RunFolder`.

    Raises:
        RunFolderError: the folder holds something else or a run with other settings, is in use, or cannot be written.
    """
    with write_errors(path):
        path.mkdir(parents=True, exist_ok=True)
        with lock(path / f"{LOCK}-opening", wait=True):  # shards that start at the same time, one after the other
            return _open_run(path, config, may_change, shard)


def _open_run(path: Path, config: dict[str, Any], may_change: tuple[str, ...], shard: str) -> RunFolder:
    if not (path / CONFIG).is_file():
        opened = RunFolder(path, shard=shard)
        opened.write_config(config)
        return opened
    different = _different(path, config)
    forbidden = [key for key in different if key not in may_change]
    if forbidden:
        raise RunFolderError(f"{path} holds another run ({', '.join(forbidden)}); choose another --out")
    opened = RunFolder(path, resume=True, shard=shard)
    if different:
        opened.write_config(config)
    return opened


@dataclass(frozen=True)
class Folder:
    """What a result folder holds.

    Attributes:
        path: Where it is.
        kind: One of `KINDS`.
        config: The settings that repeat it.
        result: What it found; None when the run has not ended.
        provenance: The versions and machines that worked here, one dictionary each.
    """

    path: Path
    kind: str
    config: dict[str, Any]
    result: dict[str, Any] | None
    provenance: list[dict[str, str]]


def find_folders(root: Path) -> list[Path]:
    """Return `root` if it is a result folder, else all result folders below it, sorted.

    Raises:
        RunFolderError: there is no such folder, or no result in it.
    """
    try:
        found = root.is_dir()
    except OSError as error:
        raise RunFolderError(f"{root} cannot be read: {error.strerror}") from error
    if not found:
        raise RunFolderError(f"{root} is not a folder")
    folders = sorted(_walk(root))
    if not folders:
        raise RunFolderError(f"no results in {root}: neither it nor a folder below has a {CONFIG}")
    return folders


def _walk(root: Path) -> Iterator[Path]:
    waiting = [str(root)]
    while waiting:  # os.walk calls itself for each level
        place = waiting.pop()
        entries = _entries(place)
        if any(entry.name == CONFIG and not entry.is_dir() for entry in entries):
            yield Path(place)
        else:
            waiting += [entry.path for entry in entries
                        if entry.is_dir(follow_symlinks=False) and not entry.name.startswith(".")]


def _entries(place: str) -> list["os.DirEntry[str]"]:
    """Return what is in a folder; nothing where that cannot be read."""
    try:
        with os.scandir(place) as entries:
            return list(entries)
    except OSError:
        return []


def read_folder(path: Path) -> Folder:
    """Read a result folder.

    Raises:
        DamagedFile: a file in it is damaged, or its settings are not those of a run.
    """
    config = read_config(path)
    kind = config["kind"]
    check(path / CONFIG, config, CONFIGS[kind])
    result = read_json(path / RESULT, RESULTS[kind], finite=kind != "study") if is_there(path / RESULT) else None
    return Folder(path, config["kind"], config, result, _provenance(path, config))


def read_config(path: Path, kind: str | None = None) -> dict[str, Any]:
    """Return the settings in a result folder.

    Args:
        path: The folder.
        kind: What it has to hold; None for any of `KINDS`.

    Raises:
        DamagedFile: they are damaged, or of another kind.
    """
    config = read_toml(path / CONFIG)
    found, expected = config.get("kind"), KINDS if kind is None else (kind,)
    if found not in expected:
        raise DamagedFile(f"{path / CONFIG} has the kind {found!r}; expected {' or '.join(expected)}")
    return config


def _provenance(path: Path, config: dict[str, Any]) -> list[dict[str, str]]:
    if not is_there(path / PROVENANCE):
        return [config["versions"]] if "versions" in config else []
    found: list[dict[str, str]] = read_json(path / PROVENANCE, Provenance)
    return found


POLL_SECONDS = 0.01


@contextmanager
def lock(path: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold a lock file, which exists as long as it is held.

    Args:
        path: The file.
        wait: Wait until no other process holds it.

    Raises:
        RunFolderError: another process holds it, or it is a link, which would lead elsewhere.
        OSError: the file cannot be written, or its disk supports no locks.
    """
    if path.is_symlink():
        raise RunFolderError(f"{path} is a link; remove it, or choose another --out")
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
