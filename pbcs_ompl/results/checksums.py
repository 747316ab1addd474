"""Checksums of the text files of a result folder, so that a digit that was changed later does not pass as a result.

`.sha256` in a folder has a line for each file, as `sha256sum` writes it. A line is added before its file gets its name:
a process that is killed in between leaves one line too many, which does no harm. A file without a line is not checked.
"""

import hashlib
import os
from collections import defaultdict
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.utf8 import utf8
from pbcs_ompl.results.files import (
    CONFIG,
    PLAN,
    PROVENANCE,
    RESULT,
    RUNS,
    is_there,
    read_bytes,
    to_json,
    to_toml,
    write_errors,
    write_text,
)

SUMS = ".sha256"


class Checksums:
    """The checksums in a folder.

    Args:
        folder: The folder; where it has no checksums, no file is checked.

    Raises:
        DamagedFile: they cannot be read.
    """

    def __init__(self, folder: Path):
        self._sums: dict[str, set[str]] = defaultdict(set)
        path = folder / SUMS
        if is_there(path):
            try:
                lines = read_bytes(path).decode(errors="replace").splitlines()
            except (OSError, ValueError) as error:
                raise DamagedFile(f"{path} is damaged: {error}") from error
            for line in lines:
                checksum, _, name = line.partition("  ")
                self._sums[name].add(checksum)

    def is_changed(self, path: Path) -> bool:
        """Return whether a file of the folder is another than the one that was written, or has gone."""
        known = self._sums.get(path.name)
        return known is not None and not (path.is_file() and _sum(read_bytes(path)) in known)


def changed_files(folder: Path) -> list[Path]:
    """Return the text files of a result folder that were changed or removed; of the records only changed ones."""
    files = [folder / name for name in (CONFIG, RESULT, PROVENANCE, PLAN)] + sorted(folder.glob(f"{RUNS}/**/*.json"))
    sums = {place: Checksums(place) for place in {file.parent for file in files}}
    return [file for file in files if sums[file.parent].is_changed(file)]


def write_summed_json(path: Path, value: Any) -> None:
    """Write JSON atomically, and its checksum."""
    _write(path, to_json(value))


def write_summed_toml(path: Path, table: dict[str, Any]) -> None:
    """Write TOML atomically, and its checksum."""
    _write(path, to_toml(table))


def _write(path: Path, text: str) -> None:
    line = f"\n{_sum(utf8(text))}  {path.name}\n"  # a line of a killed process may have no end
    with write_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path.parent / SUMS, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        try:
            os.write(handle, line.encode())
        finally:
            os.close(handle)
    write_text(path, text)


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
