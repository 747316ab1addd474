"""What JSON and TOML files of results hold: the fields that are read, their types and ranges.

Files may have more fields than these. `check` compares a value from a file with one of them.
"""

from pathlib import Path
from typing import Annotated, Any, NotRequired, TypedDict

import msgspec

from pbcs_ompl.core.env_spec import EnvValues
from pbcs_ompl.core.errors import DamagedFile

Count = Annotated[int, msgspec.Meta(ge=0)]
Positive = Annotated[int, msgspec.Meta(ge=1)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Seconds = Annotated[float, msgspec.Meta(ge=0)]
Limit = Annotated[float, msgspec.Meta(gt=0)]
Interval = tuple[Share, Share]
Versions = dict[str, str]
Table = dict[str, Any]


class Budgets(TypedDict):
    """What a run may use."""

    max_transitions: Positive
    max_seconds: NotRequired[Limit]
    max_memory: NotRequired[Limit]


class PlanConfig(Budgets):
    """config.toml of a plan."""

    planner: str
    planner_kwargs: Table
    seed: Count
    environment: EnvValues
    improve: NotRequired[Count | str]
    versions: NotRequired[Versions]


class ProgressOfImprovement(TypedDict):
    """How the length of a plan fell."""

    transitions: list[Count]
    seconds: list[Seconds]
    length: list[Count]


class Improvement(TypedDict):
    """What making a plan shorter has brought and used."""

    before: Count
    after: Count
    transitions: Count
    seconds: Seconds
    progress: ProgressOfImprovement


class TrainConfig(TypedDict):
    """config.toml of a training."""

    method: str
    planner: NotRequired[str]
    planner_kwargs: Table
    agent: str
    preset: str
    preset_versions: dict[str, int]
    settings: Table
    agent_settings: Table
    seed: Count
    max_transitions: Positive
    device: str
    environment: EnvValues
    versions: NotRequired[Versions]


class FollowerConfig(TypedDict):
    """config.toml of the training of a robot's follower; each world is a JSON text of its options."""

    environment: EnvValues
    worlds: list[str]
    settings: Table
    agent_settings: Table
    seed: Count
    max_transitions: Positive
    versions: NotRequired[Versions]


class EvalConfig(TypedDict):
    """config.toml of an evaluation."""

    chain: str
    episodes: Positive
    epsilon: Share
    environment: EnvValues


class CompareConfig(Budgets):
    """config.toml of a comparison."""

    planners: list[str]
    planner_kwargs: dict[str, Table]
    environments: list[EnvValues]
    seeds: list[Count]
    versions: Versions
    improve: NotRequired[Count | str]


class StudyConfig(TypedDict):
    """config.toml of a study, beside its sweep."""

    study: str
    folder: NotRequired[str]
    seeds: NotRequired[Positive]


class DistillConfig(TypedDict):
    """config.toml of a distillation."""

    chain: str
    settings: Table
    seed: Count
    environment: EnvValues


CONFIGS: dict[str, Any] = {"plan": PlanConfig, "train": TrainConfig, "eval": EvalConfig, "compare": CompareConfig,
                           "study": StudyConfig, "follower": FollowerConfig, "distill": DistillConfig}
"""What config.toml holds, by its `kind`: the verb that wrote it, or the result of `pbcs train --lines`."""


class PlanResult(TypedDict):
    """result.json of a plan."""

    solved: bool
    reason: NotRequired[str | None]
    transitions: Count
    seconds: Seconds
    nodes: Count
    path_length: Count | None
    replay_ok: bool | None
    improvement: NotRequired[Improvement]


class TrainResult(TypedDict):
    """result.json of a training."""

    solved: bool
    reason: str | None
    success_rate: Share
    wilson: Interval | None
    skills: Count
    plan_transitions: Count
    train_transitions: Count
    updates: Count
    seconds: Seconds


class FollowerResult(TypedDict):
    """result.json of the training of a robot's follower."""

    test_rate: float
    transitions: Count
    updates: Count
    seconds: Seconds


class EvalResult(TypedDict):
    """result.json of an evaluation."""

    success_rate: Share
    wilson: Interval
    episodes: Positive
    steps_median: Seconds | None
    epsilon: Share


class DistillResult(TypedDict):
    """result.json of a distillation."""

    solved: bool
    success_rate: Share
    wilson: Interval
    teacher_success_rate: Share
    teacher_wilson: Interval
    rounds: Count
    transitions: Count
    updates: Count
    seconds: Seconds


class Claim(TypedDict):
    """What a study says of one claim."""

    claim: str
    agrees: bool | None
    numbers: Table
    note: NotRequired[str | None]
    source: NotRequired[str | None]


class StudyResult(TypedDict):
    """result.json of a study."""

    runs: Count
    failed: dict[str, str]
    agrees: list[Claim]


RESULTS: dict[str, Any] = {"plan": PlanResult, "train": TrainResult, "eval": EvalResult, "compare": Table,
                           "study": StudyResult, "follower": FollowerResult, "distill": DistillResult}
"""What result.json holds; a comparison is read from its records."""
Provenance = list[Versions]


class Progress(TypedDict):
    """How the coverage of a run grew."""

    transitions: list[Count]
    seconds: list[Seconds]
    coverage: list[Share]


class RunOfComparison(TypedDict):
    """The record of a run of a comparison; None where nothing was measured."""

    name: str
    planner: str
    seed: Count
    environment: EnvValues
    solved: bool
    reason: str | None
    transitions: Count | None
    collision_checks: Count | None
    seconds: Seconds | None
    nodes: Count | None
    path_length: Count | None
    replay_ok: bool | None
    memory: Seconds | None
    coverage: Share | None
    progress: Progress | None
    planner_settings: Table | None
    improvement: NotRequired[Improvement | None]


class RunOfStudy(TypedDict):
    """The record of a run of a study, beside what only its analysis knows."""

    seed: NotRequired[Any]
    seeds: NotRequired[list[Count]]


class Versioned(TypedDict):
    """The beginning of the words in a trajectory."""

    format: int


class TrajectoryWords(Versioned):
    """The words in a trajectory."""

    environment: EnvValues
    planner: str
    seed: Count
    reset_seed: Count | None
    versions: Versions


class CheckpointVersion(TypedDict):
    """The beginning of the words in a checkpoint."""

    version: int


class CheckpointWords(CheckpointVersion):
    """The words in a checkpoint: the seconds of training before it, and the state of the method."""

    seconds: Seconds
    plain: Table


class PlanEffort(TypedDict):
    """plan.json of a training."""

    transitions: Count


def check(path: Path, value: Any, kind: Any) -> None:
    """Compare what a file holds with what it should hold.

    Args:
        path: The file.
        value: What it holds.
        kind: A type of this module.

    Raises:
        DamagedFile: a field is missing, or has another type or range; the message names it.
    """
    try:
        msgspec.convert(value, kind)
    except (msgspec.ValidationError, RecursionError) as error:
        raise DamagedFile(f"{path} is damaged: {in_words(error)}") from error


def in_words(error: Exception) -> str:
    """Return msgspec's message as ours: 'seconds: expected `float`, got `str`'."""
    text, found, place = str(error).partition(" - at `$")
    text = text[:1].lower() + text[1:]
    return f"{place.rstrip('`').lstrip('.')}: {text}" if found else text


