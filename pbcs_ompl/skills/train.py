"""From an environment to a trained skill chain."""

from pathlib import Path
from typing import Any

import gymnasium

from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, RunFolderError, TrainingStalled, UnknownName
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.types import Counter, ProgressCallback
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.results.files import CHECKPOINT, CONFIG, RESULT, read_toml
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.skills.config import TrainConfig
from pbcs_ompl.skills.result import TrainResult
from pbcs_ompl.skills.training import Training


def train(env: str | EnvSpec | gymnasium.Env | ResettableModel, *, env_kwargs: dict[str, Any] | None = None,
          goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None, start_seed: int | None = None,
          trajectory: Trajectory | None = None, out: str | Path | None = None,
          on_progress: ProgressCallback | None = None, **options: Any) -> TrainResult:
    """Plan (unless a trajectory is given) and train skills along the plan.

    Args:
        env: A Gymnasium id, an `EnvSpec`, an environment, or its resettable model.
        env_kwargs: Options of the environment, when `env` is an id.
        goal, feature, start_seed: See `pbcs_ompl.make`.
        trajectory: A plan made before.
        out: A new folder for config.toml, result.json, trajectory.npz, chain/ and, until the end, checkpoint.npz.
        on_progress: Called after every session and test with plain numbers.
        options: The fields of `TrainConfig`: method, planner, planner_kwargs, agent, preset, settings, agent_settings,
            seed, max_transitions, device.

    Raises:
        UnknownName, InvalidOption: no such method, planner, agent, preset or setting; values out of range; a planner
            beside a trajectory.
        NotResettable, UnsupportedSpace: the environment does not fit.
        Mismatch: the trajectory belongs to another environment, or does not reach its goal.
        RunFolderError: the folder exists, is in use, or cannot be written.
        CallbackFailed: the environment raised, or returned NaN.
        TrainingStalled: the budget ended first; its `result` holds what was learnt so far.
    """
    config = _config(options)
    model = make(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed)
    if trajectory is not None:
        if config.chooses_planner:
            raise InvalidOption("a trajectory is given, so nothing is planned; remove planner and planner_kwargs")
        trajectory.check_belongs_to(model)
    elif config.chooses_planner:
        _check_planner(model, config)
    if out is None:
        return _checked(Training(model, config, None, on_progress, False).run(trajectory))
    with RunFolder(out) as folder:
        return _checked(Training(model, config, folder, on_progress, False).run(trajectory))


def resume(folder: str | Path, *, max_transitions: int | None = None,
           on_progress: ProgressCallback | None = None) -> TrainResult:
    """Go on with an interrupted training; the result is that of an uninterrupted one, bit for bit.

    Args:
        folder: The `out` of the training.
        max_transitions: A new budget, for a training that has used up its own.

    Raises:
        RunFolderError: there is nothing to resume, or another process is at it.
        DamagedFile: a file in the folder is damaged.
    """
    with RunFolder(folder, resume=True) as opened:
        if (opened.path / RESULT).is_file() and not (opened.path / CHECKPOINT).is_file():
            raise RunFolderError(f"the training in {opened.path} has ended; there is nothing to resume")
        values = read_toml(opened.path / CONFIG) | ({"max_transitions": max_transitions} if max_transitions else {})
        try:
            others = {name: values[name] for name in values.keys() - {"kind", "environment", "versions"}}
            environment, config = EnvSpec.from_dict(values["environment"]), TrainConfig(**others)
        except (KeyError, TypeError) as error:
            raise DamagedFile(f"{opened.path / CONFIG} is not the configuration of a training: {error}") from error
        if max_transitions:
            opened.write_config(values)
        return _checked(Training(make(environment), config, opened, on_progress, True).run(None))


def _check_planner(model: ResettableModel, config: TrainConfig) -> None:
    """Build the planner once, so that what it refuses is refused before a folder is made."""
    with quiet_ompl(), make_problem(model, seed=config.seed, counter=Counter()) as problem:
        PlannerSpec(config.planner, config.planner_kwargs).build(problem.space_information, config.seed)


def _checked(result: TrainResult) -> TrainResult:
    if result.stalled:
        raise TrainingStalled(result.stalled, result)
    return result


def _config(options: dict[str, Any]) -> TrainConfig:
    known = TrainConfig.__dataclass_fields__
    for name in options:
        if name not in known:
            raise UnknownName("option of train", name, known)
    return TrainConfig(**options)
