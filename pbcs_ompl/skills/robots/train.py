"""From environments of one robot to its follower: train on random lines, keep the best policy, resume."""

import json
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.agents.ppo import PPOSettings
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, RunFolderError
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.signals import interruptible
from pbcs_ompl.core.text_values import parse_json
from pbcs_ompl.core.types import ProgressCallback
from pbcs_ompl.resettable import make
from pbcs_ompl.results.checksums import changed_files
from pbcs_ompl.results.files import CHECKPOINT, CONFIG, FOLLOWER, RESULT, is_there, read_arrays, read_toml, write_arrays
from pbcs_ompl.results.folder import RunFolder, read_config
from pbcs_ompl.results.schema import FollowerConfig, check
from pbcs_ompl.skills.robots.follower import RobotFollower
from pbcs_ompl.skills.robots.settings import RobotSettings
from pbcs_ompl.skills.robots.training import RobotTraining
from pbcs_ompl.skills.robots.worlds import Worlds
from pbcs_ompl.skills.training import CHECKPOINT_SECONDS, training_versions


@dataclass(frozen=True, eq=False)
class FollowerResult:
    """The result of the training of a follower.

    Attributes:
        follower: The policy with the best test, for any line.
        test_rate: Fraction of the test lines to whose end it came, without noise, in the worlds of training.
        transitions: Environment steps, those of tests included.
        updates: Gradient steps.
        seconds: Wall time.
        seed: Root of all random streams.
        out: The folder; None when none was asked for.
    """

    follower: RobotFollower
    test_rate: float
    transitions: int
    updates: int
    seconds: float
    seed: int
    out: str | None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers."""
        return {"test_rate": self.test_rate, "transitions": self.transitions, "updates": self.updates,
                "seconds": self.seconds, "seed": self.seed, "out": self.out}


@checked
def train_follower(env: str | EnvSpec, *, env_kwargs: dict[str, Any] | None = None,
                   worlds: Sequence[dict[str, Any]] | None = None, settings: dict[str, Any] | None = None,
                   agent_settings: dict[str, Any] | None = None, seed: int = 0, max_transitions: int = 1_000_000,
                   out: str | Path | None = None, on_progress: ProgressCallback | None = None) -> FollowerResult:
    """Train one policy that follows any line with a robot, on random lines in the free space of some worlds.

    Args:
        env: A Gymnasium id, or an `EnvSpec`; the environment declares a robot (see `pbcs_ompl.core.robot`).
        env_kwargs: Options of all worlds, when `env` is an id. Episodes end where the environment terminates: let it
            do so where the robot has fallen.
        worlds: Options that differ from world to world, such as the seed of a maze; None for one world.
        settings: Settings that differ from those of `RobotSettings`, by name or path.
        agent_settings: Settings that differ from those of `PPOSettings`.
        seed: Root of all random streams; equal seeds give equal results.
        max_transitions: Budget of environment steps, those of tests included; the last test is cut off at it.
        out: A new folder for config.toml, result.json, follower/ and, until the end, checkpoint.npz.
        on_progress: Called after every iteration with plain numbers.

    Raises:
        UnknownName, InvalidOption: an environment, an option or a setting that does not exist or is out of range.
        Mismatch: the environment declares no robot, or explores no plane.
        InvalidState: a world has no space for lines.
        RunFolderError: the folder exists, is in use, or cannot be written.
    """
    if isinstance(env, EnvSpec) and env_kwargs:
        raise InvalidOption("options of the environment go with its id; this spec has its own")
    spec = env if isinstance(env, EnvSpec) else EnvSpec(env, env_kwargs or {})
    unused = [name for name in ("goal", "feature") if getattr(spec, name) is not None]
    if unused:
        raise InvalidOption(f"{' and '.join(unused)} of {spec.label} would not be used: lines of a follower lie in the "
                            "plane of the robot's place, and end anywhere; leave them out")
    if worlds is not None and not worlds:
        raise InvalidOption("worlds is empty; expected options of at least one world, or None")
    if max_transitions < 1:
        raise InvalidOption(f"max_transitions={max_transitions}; expected at least 1")
    run = _Run(spec, tuple(worlds or ({},)), RobotSettings().updated(settings or {}),
               PPOSettings.from_dict(agent_settings or {}), seed, max_transitions, on_progress)
    if out is None:
        return run.make(None)
    training = run.training()  # refuses what does not fit before there is a folder
    with RunFolder(out) as folder:
        return run.make(folder, training)


@checked
def resume_follower(folder: str | Path, *, max_transitions: int | None = None, trust: bool = False,
                    on_progress: ProgressCallback | None = None) -> FollowerResult:
    """Continue the interrupted training of a follower; the result is that of an uninterrupted one, bit for bit.

    Args:
        folder: The `out` of the training.
        max_transitions: A new budget; also for a training that has ended, as long as it has a checkpoint.
        trust: Import the modules that the folder names.
        on_progress: Called after every iteration with plain numbers.

    Raises:
        RunFolderError: there is nothing to resume, or another process uses the folder.
        DamagedFile: a file in the folder is damaged.
    """
    with RunFolder(folder, resume=True) as opened:
        config = read_config(opened.path, "follower")
        check(opened.path / CONFIG, config, FollowerConfig)
        for file in (file for file in changed_files(opened.path) if file.name == CONFIG):
            warnings.warn(f"{file} was changed after it was written; the training goes by what it says now",
                          stacklevel=2)
        if is_there(opened.path / RESULT) and not is_there(opened.path / CHECKPOINT):
            raise RunFolderError(f"the training in {opened.path} has ended; there is nothing to resume")
        if max_transitions is not None:
            opened.write_config(read_toml(opened.path / CONFIG) | {"max_transitions": max_transitions})
        run = _Run(EnvSpec.from_dict(config["environment"], trusted=trust),
                   _worlds(opened.path / CONFIG, config["worlds"]), RobotSettings.from_dict(config["settings"]),
                   PPOSettings.from_dict(config["agent_settings"]), config["seed"],
                   max_transitions or config["max_transitions"], on_progress)
        return run.make(opened, resumed=True)


@dataclass(frozen=True)
class _Run:
    """All that a training depends on."""

    spec: EnvSpec
    worlds: tuple[dict[str, Any], ...]
    settings: RobotSettings
    agent_settings: PPOSettings
    seed: int
    max_transitions: int
    on_progress: ProgressCallback | None

    def training(self) -> RobotTraining:
        """Return the training as new."""
        models = [make(replace(self.spec, kwargs={**self.spec.kwargs, **world})) for world in self.worlds]
        worlds = Worlds.of(models, self.settings.lines, SeedTree(self.seed))
        return RobotTraining(worlds, self.settings, self.agent_settings, self.seed)

    def make(self, folder: RunFolder | None, training: RobotTraining | None = None, *,
             resumed: bool = False) -> FollowerResult:
        """Train until the budget is used up; write checkpoints and the result."""
        with one_thread(), code_of_others("the environment"):
            training = training or self.training()
            least = training.transitions + training.iteration_transitions
            if self.max_transitions < least:
                raise InvalidOption(f"max_transitions={self.max_transitions}; expected at least {least}, for the "
                                    "bodies that episodes begin with and one iteration")
            seconds = 0.0
            if folder is not None and not resumed:
                folder.write_config({"kind": "follower", "environment": self.spec.to_dict(), "seed": self.seed,
                                     "worlds": [json.dumps(world) for world in self.worlds],
                                     "settings": self.settings.to_dict(), "versions": training_versions(),
                                     "agent_settings": self.agent_settings.to_dict(),
                                     "max_transitions": self.max_transitions})
            if folder is not None and resumed and is_there(folder.path / CHECKPOINT):
                seconds = _restore(training, folder.path / CHECKPOINT)
            return self._train(training, folder, time.perf_counter() - seconds)

    def _train(self, training: RobotTraining, folder: RunFolder | None, began: float) -> FollowerResult:
        stops: list[KeyboardInterrupt] = []
        path = None if folder is None else folder.path
        saved = time.perf_counter()
        with interruptible(stops.append):
            while training.transitions + training.iteration_transitions <= self.max_transitions:
                if training.transitions >= training.next_test:
                    if training.transitions + training.longest_test > self.max_transitions:
                        break  # a test that the budget cuts off is the last one
                    training.test(self.max_transitions)
                    continue
                numbers = training.iterate()
                if path is not None and (stops or time.perf_counter() - saved > CHECKPOINT_SECONDS):
                    _checkpoint(training, path / CHECKPOINT, time.perf_counter() - began)
                    saved = time.perf_counter()
                if stops:
                    raise stops[0]
                if self.on_progress is not None:
                    self.on_progress({"phase": "train", **numbers})
        if path is not None:  # before the last test, which a training with a larger budget does not make
            _checkpoint(training, path / CHECKPOINT, time.perf_counter() - began)
        training.test(self.max_transitions)
        return self._finish(training, folder, time.perf_counter() - began)

    def _finish(self, training: RobotTraining, folder: RunFolder | None, seconds: float) -> FollowerResult:
        model = training.worlds.models[0]
        record = {"seed": self.seed, "transitions": training.transitions, "updates": training.agent.num_updates,
                  "test_rate": training.best_rate, "worlds": list(self.worlds), "settings": self.settings.to_dict(),
                  "agent_settings": self.agent_settings.to_dict(), "versions": training_versions()}
        follower = RobotFollower(training.best, training.view, self.spec, model.actions,  # type: ignore[attr-defined]
                                 self.settings.lines.spacing, self.settings.lines.clearance, record)
        result = FollowerResult(follower, training.best_rate, training.transitions, training.agent.num_updates, seconds,
                                self.seed, None if folder is None else str(folder.path))
        if folder is not None:
            follower.save(folder.path / FOLLOWER)
            folder.write_result(result.summary())
        return result


def _worlds(path: Path, texts: list[str]) -> tuple[dict[str, Any], ...]:
    """Return the options of the worlds that a config.toml holds as JSON texts."""
    worlds = []
    for text in texts:
        try:
            worlds.append(parse_json(text))
        except ValueError as error:
            raise DamagedFile(f"{path} is damaged: in worlds, {text[:80]!r} is no JSON: {error}") from error
        if not isinstance(worlds[-1], dict):
            raise DamagedFile(f"{path} is damaged: in worlds, {text[:80]!r} is no object of options")
    if not worlds:
        raise DamagedFile(f"{path} is damaged: worlds is empty")
    return tuple(worlds)


def _checkpoint(training: RobotTraining, path: Path, seconds: float) -> None:
    write_arrays(path, seconds=np.array(seconds), **training.state_dict())


def _restore(training: RobotTraining, path: Path) -> float:
    """Let a training continue from a checkpoint; return the seconds before it."""
    arrays = read_arrays(path)
    try:
        training.load_state_dict(arrays)
        return float(arrays["seconds"])
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise DamagedFile(f"{path} is damaged, or that of another training: {error!r}") from error
