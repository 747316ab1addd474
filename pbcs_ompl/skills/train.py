"""From an environment to a trained controller."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium

from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import RunFolderError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.types import Counter, ProgressCallback
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.known_goal import check_goal
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.results.checksums import changed_files
from pbcs_ompl.results.files import CHECKPOINT, CONFIG, PLAN, RESULT, is_there, read_json, read_toml
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.skills.config import TrainConfig, read_config, usual_method
from pbcs_ompl.skills.train_result import TrainResult
from pbcs_ompl.skills.training import Training, training_versions


@checked
def train(env: str | EnvSpec | gymnasium.Env | ResettableModel, *, trajectory: Trajectory | None = None,
          method: str | None = None, agent: str = "ddpg", preset: str = "fast", settings: dict[str, Any] | None = None,
          agent_settings: dict[str, Any] | None = None, planner: str | None = None,
          planner_kwargs: dict[str, Any] | None = None, env_kwargs: dict[str, Any] | None = None,
          goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None, start_seed: int | None = None,
          reset_options: dict[str, Any] | None = None, max_episode_steps: int | None = None, seed: int = 0,
          max_transitions: int = 10_000_000, device: str = "cpu", out: str | Path | None = None,
          on_progress: ProgressCallback | None = None) -> TrainResult:
    """Plan (unless a trajectory is given) and train skills along the plan.

    Args:
        env: A Gymnasium id, an `EnvSpec`, an environment, or its resettable model.
        trajectory: A plan made before.
        method: "pbcs", "follow", "pb", "backplay", "plain", "bootstrapped" or "offline"; None for that of the
            preset: "pbcs" of "thesis", and of "fast" "follow", or "pbcs" where the explored feature is not observed.
        agent: A registered agent, or module:Class.
        preset: Named settings of the method and of the agent: "fast" or "thesis".
        settings: Settings of the method that differ from the preset, by name ({"epsilon": 0.2}), by path
            ({"episodes.epsilon": 0.2}) or as tables.
        agent_settings: Settings of the agent that differ from the preset.
        planner: A registered planner, or module:attribute; None for that of the method (Rides of "follow", else Ex), or
            where nothing is planned.
        planner_kwargs: Options of the planner.
        env_kwargs: Options of the environment, when `env` is an id.
        goal, feature, start_seed, reset_options, max_episode_steps: See `pbcs_ompl.make`.
        seed: Root of all random streams; equal seeds give equal results.
        max_transitions: Budget of environment steps, planning included; the executions of the judge do not count.
        device: Where the agent trains, "cpu" or "cuda".
        out: A new folder for config.toml, result.json, trajectory.npz, chain/ and, until the end, checkpoint.npz.
        on_progress: Called after every session and test with plain numbers.

    Returns:
        The result. When it is not solved, `reason` says why.

    Raises:
        UnknownName, InvalidOption: no such method, planner, agent, preset or setting; values out of range; a planner
            or a trajectory that would not be used.
        NotResettable, UnsupportedSpace: the environment does not fit.
        Mismatch: the trajectory belongs to another environment, or does not reach its goal.
        RunFolderError: the folder exists, is in use, or cannot be written.
        CallbackFailed: the environment raised, or returned NaN.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0)
        >>> result.solved, result.robust.success_rate >= 0.95
        (True, True)
    """
    model = make(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed, reset_options=reset_options,
                 max_episode_steps=max_episode_steps)
    check_goal(model)
    config = TrainConfig.resolve(
        method=method or usual_method(preset, model), planner=planner, planner_kwargs=planner_kwargs, agent=agent,
        preset=preset, settings=settings, agent_settings=agent_settings, seed=seed, max_transitions=max_transitions,
        device=device, planned=trajectory is not None)
    if trajectory is not None:
        trajectory.check_belongs_to(model)
    if planner is not None or planner_kwargs:
        _check_planner(model, config)
    if out is None:
        return Training(model, config, None, on_progress, False).run(trajectory)
    with RunFolder(out) as folder:
        return Training(model, config, folder, on_progress, False).run(trajectory)


@checked
def resume(folder: str | Path, *, max_transitions: int | None = None, trust: bool = False,
           on_progress: ProgressCallback | None = None) -> TrainResult:
    """Continue an interrupted training; the result is that of an uninterrupted one, bit for bit.

    Every setting is what the folder holds; presets are not read again. Where packages have other versions than those
    that the training began with, a warning names them.

    Args:
        folder: The `out` of the training.
        max_transitions: A new budget, for a training that has used up its own.
        trust: Import the modules that the folder names, such as an agent `module:Class`. Say so only of a folder whose
            author you trust: they run.
        on_progress: Called after every session and test with plain numbers.

    Raises:
        RunFolderError: there is nothing to resume, or another process uses the folder.
        DamagedFile: a file in the folder is damaged.
        UntrustedModule: the folder names a module, and is not trusted.

    Example:
        >>> import pbcs_ompl
        >>> begun = pbcs_ompl.train("pbcs/Maze-v0", seed=0, max_transitions=600, out="runs/maze")
        >>> begun.solved
        False
        >>> pbcs_ompl.resume("runs/maze", max_transitions=100_000).solved
        True
    """
    with RunFolder(folder, resume=True) as opened:
        if _has_ended(opened.path):
            raise RunFolderError(f"the training in {opened.path} has ended; there is nothing to resume")
        environment, config, versions = read_config(opened.path / CONFIG, trust=trust)
        _warn_of_other_versions(opened.path, versions)
        for file in (file for file in changed_files(opened.path) if file.name in (CONFIG, PLAN)):
            warnings.warn(f"{file} was changed after it was written; the training goes by what it says now",
                          stacklevel=2)
        if max_transitions is not None:
            config = replace(config, max_transitions=max_transitions)
            opened.write_config(read_toml(opened.path / CONFIG) | {"max_transitions": max_transitions})
        return Training(make(environment), config, opened, on_progress, True).run(None)


def _has_ended(path: Path) -> bool:
    """Return whether a larger budget changes nothing: one that ended before training began has no checkpoint."""
    if not is_there(path / RESULT) or is_there(path / CHECKPOINT):
        return False
    complete: bool = read_json(path / RESULT, dict[str, Any]).get("complete", True)
    return complete


def _check_planner(model: ResettableModel, config: TrainConfig) -> None:
    """Build the planner once, so that what it refuses is refused before a folder is made."""
    with quiet_ompl(), make_problem(model, seed=config.seed, counter=Counter()) as problem:
        PlannerSpec(config.planner, config.planner_kwargs).build(problem.space_information, config.seed)


def _warn_of_other_versions(path: Path, before: dict[str, str]) -> None:
    now = training_versions()
    changed = [f"{name} {before.get(name, 'missing')} (now {now.get(name, 'missing')})"
               for name in sorted(before.keys() | now.keys()) if before.get(name) != now.get(name)]
    if changed:
        warnings.warn(f"{path} was begun with other versions, so the result may differ from that of an uninterrupted "
                      f"training: {', '.join(changed)}", stacklevel=3)
