"""The three files of a chain, which are read together: a change of any of them is found by its checksum.

chain.json has the structure, and the SHA-256 of itself and of the other two; chain.npz the arrays, such as activation
sets or a line; chain.safetensors the policies.
"""

import hashlib
import json
import warnings
from pathlib import Path
from typing import Any, NamedTuple, TypedDict

import numpy as np

from pbcs_ompl.core.env_spec import EnvValues
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.plain import plain
from pbcs_ompl.results.arrays import NUMBERS, take
from pbcs_ompl.results.files import read_arrays, read_bytes, read_json, write_arrays, write_json
from pbcs_ompl.results.schema import Count, Positive, check
from pbcs_ompl.skills.policy import SkillPolicy, load_policies, save_policies

STRUCTURE, SETS, POLICIES = "chain.json", "chain.npz", "chain.safetensors"
VERSION = 5


class SkillWords(TypedDict):
    """What chain.json says of a skill."""

    activation: str
    target: str
    entry: list[str]


class ChainWords(TypedDict):
    """What chain.json holds."""

    environment: EnvValues
    time_limit: Positive
    reset_seed: Count | None
    action_shape: list[Count]
    skills: list[SkillWords]
    sha256: dict[str, str]


class PlaceWords(TypedDict):
    """What chain.json says of a policy of a follower."""

    first: Count


class FollowerWords(TypedDict):
    """What chain.json of a follower holds."""

    environment: EnvValues
    time_limit: Positive
    reset_seed: Count | None
    action_shape: list[Count]
    skills: list[PlaceWords]
    spacing: float
    window: float
    patience: Positive
    sha256: dict[str, str]


KINDS: dict[str, type] = {"skill chain": ChainWords, "follower": FollowerWords}
"""What a folder may hold, by the name in its format."""


class ChainContent(NamedTuple):
    """What the three files hold: plain values, arrays, and the policies of the skills."""

    structure: dict[str, Any]
    arrays: dict[str, np.ndarray]
    policies: list[SkillPolicy]


def kind_in(folder: Path) -> str:
    """Return the kind of the chain in a folder.

    Raises:
        DamagedFile: chain.json is missing, or that of none.
    """
    path = folder / STRUCTURE
    words = read_json(path)
    found = words.get("format") if isinstance(words, dict) else None
    kinds = {_format(kind): kind for kind in KINDS}
    if found not in kinds:
        raise DamagedFile(f"{path} is not a skill chain")
    return kinds[found]


def _format(kind: str) -> str:
    return f"pbcs_ompl {kind}"


def write_chain(folder: Path, kind: str, content: ChainContent) -> None:
    """Write the files of a chain; chain.json last, which makes the other two valid.

    Args:
        folder: The folder.
        kind: One of `KINDS`.
        content: What they are to hold.

    Raises:
        RunFolderError: a file cannot be written.
        MissingDependency: safetensors is not installed.
    """
    save_policies(folder / POLICIES, content.policies)
    write_arrays(folder / SETS, **content.arrays)
    whole = {"format": _format(kind), "version": VERSION, **content.structure}
    sums = {name: _sum(read_bytes(folder / name)) for name in (SETS, POLICIES)}
    write_json(folder / STRUCTURE, {**whole, "sha256": {STRUCTURE: _sum_of_words(whole), **sums}})


def read_chain(folder: Path, kind: str, *, trust: bool) -> ChainContent:
    """Return what `write_chain` was given.

    Args:
        folder: The folder.
        kind: One of `KINDS`.
        trust: Accept a chain.json that was changed after it was written, with a warning.

    Raises:
        DamagedFile: a file is missing, truncated, of another version, or changed.
    """
    path = folder / STRUCTURE
    found = kind_in(folder)
    if found != kind:
        raise DamagedFile(f"{path} is that of a {found}, not of a {kind}; read it with pbcs_ompl.load_chain")
    words = read_json(path, dict[str, Any])
    if words.get("version") != VERSION:
        raise DamagedFile(f"{path} has version {words.get('version')}, expected {VERSION}")
    check(path, words, KINDS[kind])
    sums = words.pop("sha256")
    for name in (SETS, POLICIES):
        _compare(folder / name, sums.get(name))
    if sums.get(STRUCTURE) != _sum_of_words(words):
        if not trust:
            raise DamagedFile(f"{path} was changed after it was written, so the chain may act differently. If you "
                              "trust whoever changed it, add --trust to the command, or trust=True in Python")
        warnings.warn(f"{path} was changed after it was written", stacklevel=3)
    arrays = read_arrays(folder / SETS)
    numbers = {name: take(folder / SETS, arrays, name, array.shape, kinds=NUMBERS) for name, array in arrays.items()}
    return ChainContent(words, numbers, load_policies(folder / POLICIES, len(words["skills"])))


def _compare(path: Path, expected: str | None) -> None:
    try:
        found = _sum(read_bytes(path))
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except (OSError, ValueError) as error:
        raise DamagedFile(f"{path} is damaged: {error}") from error
    if found != expected:
        raise DamagedFile(f"{path} is damaged: its SHA-256 is not the one that {STRUCTURE} has")


def _sum_of_words(words: dict[str, Any]) -> str:
    """Return the checksum of plain values, whatever the spaces and the order of the keys in their file."""
    return _sum(json.dumps(words, sort_keys=True, default=plain).encode())


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
