"""The interface of training methods, and the checkpoints from which they resume."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.plain import plain
from pbcs_ompl.results.arrays import NUMBERS, take, take_words
from pbcs_ompl.results.files import read_arrays, write_arrays
from pbcs_ompl.results.schema import CheckpointVersion, CheckpointWords
from pbcs_ompl.skills.trained_controller import TrainedController
from pbcs_ompl.skills.trainer import SkillTrainer

VERSION = 5
WORDS = "__plain__"
"""The array with the plain values, as JSON."""


@dataclass(frozen=True)
class Snapshot:
    """Everything a method needs to resume: plain values, and arrays by name."""

    plain: dict[str, Any]
    arrays: dict[str, np.ndarray]


class TrainingMethod(Protocol):
    """Turns waypoints into skills in small steps; training can stop after each of them.

    Attributes:
        trainer: What trains the agent, and counts transitions and updates.
    """

    trainer: SkillTrainer

    @property
    def refusals(self) -> int:
        """How often training has continued after the judge had refused a finished chain."""
        return 0

    @property
    def done(self) -> bool:
        """Whether the skills lead from the start state to the goal."""
        ...

    def step(self) -> None:
        """Do one session or one test."""
        ...

    @property
    def skills(self) -> Sequence[Any]:
        """The skills so far, in the order of execution; the last one leads to the environment's goal."""
        ...

    @property
    def covered(self) -> float:
        """Fraction of the plan that the skills so far cover, in [0, 1]."""
        ...

    @property
    def standing(self) -> str:
        """How far training has come, in words: "52% of the plan covered"."""
        ...

    @property
    def longest_step(self) -> int:
        """The most transitions that the next step may take; a larger number where that is not known."""
        ...

    def refused(self) -> bool:
        """Continue training after the judge has refused a finished chain; return whether the method does that."""
        return False

    def chain(self, steps_per_skill: int) -> TrainedController | None:
        """Return the skills so far as a controller; None where there are none.

        Args:
            steps_per_skill: Time limit of an execution, in steps for each skill.
        """
        ...

    def snapshot(self) -> Snapshot:
        """Return everything needed to resume bit for bit."""
        ...

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from what `snapshot` returned."""
        ...


def write_checkpoint(path: Path, snapshot: Snapshot, seconds: float) -> None:
    """Write a snapshot and the seconds of training so far, atomically."""
    text = json.dumps({"version": VERSION, "seconds": seconds, "plain": snapshot.plain}, default=plain)
    write_arrays(path, **{WORDS: np.array(text)}, **snapshot.arrays)


def read_checkpoint(path: Path) -> tuple[Snapshot, float]:
    """Return the snapshot and the seconds of training before it.

    Raises:
        DamagedFile: the file is missing, truncated, or of another version.
    """
    arrays = read_arrays(path)
    version = take_words(path, arrays, WORDS, CheckpointVersion, finite=False)["version"]
    if version != VERSION:
        raise DamagedFile(f"{path} has version {version}, expected {VERSION}; train again from scratch")
    values = take_words(path, arrays, WORDS, CheckpointWords, finite=False)
    numbers = {name: take(path, arrays, name, array.shape, kinds=NUMBERS, finite=False)
               for name, array in arrays.items() if name != WORDS}
    return Snapshot(values["plain"], numbers), values["seconds"]


def restore(method: TrainingMethod, path: Path) -> float:
    """Let a method resume from a checkpoint; return the seconds of training before it.

    Raises:
        DamagedFile: the file is missing, truncated, of another version, or that of another training.
    """
    snapshot, seconds = read_checkpoint(path)
    try:
        method.restore(snapshot)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise DamagedFile(f"{path} is damaged, or that of another training: {error!r}") from error
    return seconds
