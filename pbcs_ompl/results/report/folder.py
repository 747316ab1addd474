"""Find result folders, and read what they all have in common."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.results.folder import CONFIG, PROVENANCE, RESULT, read_json, read_toml

KINDS = ("plan", "train", "eval", "compare", "study")
"""What a folder may hold: the `kind` of its config.toml, named after the verb that wrote it."""


@dataclass(frozen=True)
class Folder:
    """A result folder.

    Attributes:
        path: Where it is.
        kind: One of `KINDS`.
        config: The settings that repeat it.
        result: What came out; None when the run has not ended.
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
    if not root.is_dir():
        raise RunFolderError(f"{root} is not a folder")
    found = sorted(_walk(root))
    if not found:
        raise RunFolderError(f"no results in {root}: neither it nor a folder below has a {CONFIG}")
    return found


def _walk(root: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(root):
        if CONFIG in files:
            folders.clear()
            yield Path(place)
        folders[:] = [name for name in folders if not name.startswith(".")]


def read_folder(path: Path) -> Folder:
    """Read a result folder.

    Raises:
        DamagedFile: a file in it is damaged, or its settings are not those of a run.
    """
    config = read_toml(path / CONFIG)
    kind = config.get("kind")
    if kind not in KINDS:
        raise DamagedFile(f"{path / CONFIG} is not that of a run: its kind is {kind!r}; expected one of "
                          f"{', '.join(KINDS)}")
    result = read_json(path / RESULT) if (path / RESULT).is_file() else None
    if not isinstance(result, dict | None):
        raise DamagedFile(f"{path / RESULT} is not a result; expected a JSON object")
    return Folder(path, kind, config, result, _provenance(path, config))


def _provenance(path: Path, config: dict[str, Any]) -> list[dict[str, str]]:
    if not (path / PROVENANCE).is_file():
        return [config["versions"]] if "versions" in config else []
    found = read_json(path / PROVENANCE)
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise DamagedFile(f"{path / PROVENANCE} is damaged: expected a list of JSON objects")
    return found
