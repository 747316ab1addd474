"""One training: plan, train skills along the plan, evaluate; it can be stopped and resumed at any moment."""

import threading
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.termination import interruptible
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import CallbackFailed, Mismatch, PbcsError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Counter, ProgressCallback
from pbcs_ompl.results.files import CHAIN, CHECKPOINT, PLAN, TRAJECTORY, read_json, write_json
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.results.provenance import planning_versions
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.checkpoint import read_checkpoint, write_checkpoint
from pbcs_ompl.skills.config import METHODS, WITHOUT_PLAN, TrainConfig
from pbcs_ompl.skills.evaluation import evaluate
from pbcs_ompl.skills.learner import Learner
from pbcs_ompl.skills.method import Method
from pbcs_ompl.skills.milestones import Milestones
from pbcs_ompl.skills.result import TrainResult

MILESTONES = "milestones.npz"
CHECKPOINT_SECONDS = 30.0
ROBUST_EPSILON = 0.1
ROBUST_RATE = 0.95


class Training:
    """A run: its settings, its folder (if any), its clock.

    Args:
        resumed: Go on from what the folder holds.
    """

    def __init__(self, model: ResettableModel, config: TrainConfig, folder: RunFolder | None,
                 on_progress: ProgressCallback | None, resumed: bool):
        self.model, self.config, self.on_progress = model, config, on_progress
        self.folder = folder
        self.path = folder.path if folder else None
        self.resumed = resumed
        self.settings = config.skill_settings()
        self.seeds = SeedTree(config.seed)
        self.began = self.last_checkpoint = time.perf_counter()
        self.make_agent = config.agent_factory(model)

    def run(self, trajectory: Trajectory | None) -> TrainResult:
        """Plan (or take the plan that is given or was made before), train, evaluate and write."""
        with one_thread():
            return self._run(trajectory)

    def _run(self, trajectory: Trajectory | None) -> TrainResult:
        self._write_config()
        trajectory, planned = self._plan(trajectory)
        if trajectory is None and self.config.method not in WITHOUT_PLAN:
            return self._finish(None, None, planned, "the planner found no way to the goal within the budget")
        method = self._method(trajectory, planned)
        return self._finish(method, trajectory, planned, self._train(method))

    def _write_config(self) -> None:
        config = self.config
        if self.folder and not self.resumed:
            self.folder.write_config({
                "kind": "train", "method": config.method, "planner": config.planner, "agent": config.agent,
                "preset": config.preset, "seed": config.seed, "max_transitions": config.max_transitions,
                "device": config.device, "environment": self.model.spec.to_dict(),
                "planner_kwargs": config.planner_kwargs,
                "settings": config.settings, "agent_settings": config.agent_settings,
                "versions": planning_versions() | {"torch": version("torch")}})

    def _plan(self, trajectory: Trajectory | None) -> tuple[Trajectory | None, int]:
        """Return the plan and the transitions it took."""
        if self.config.method in WITHOUT_PLAN:
            return None, 0
        if self.path and self.resumed and (self.path / PLAN).is_file():
            trajectory = Trajectory.load(self.path / TRAJECTORY)
            trajectory.check_belongs_to(self.model)
            return trajectory, read_json(self.path / PLAN)["transitions"]
        transitions = 0
        if trajectory is None:
            found = plan(self.model, self.config.planner, planner_kwargs=self.config.planner_kwargs,
                         seed=self.seeds.child("plan").integer(), max_transitions=self.config.max_transitions,
                         on_progress=self._planning)
            trajectory, transitions = found.trajectory, found.transitions
        elif self.model.goal_distance(trajectory.states[-1:])[0] >= self.model.goal_threshold:
            raise Mismatch("the trajectory does not end in the environment's goal")
        if self.path and trajectory is not None:
            trajectory.save(self.path / TRAJECTORY)
            write_json(self.path / PLAN, {"transitions": transitions})
        return trajectory, transitions

    def _method(self, trajectory: Trajectory | None, planned: int) -> Method:
        """Return the training method, as new or as the checkpoint left it."""
        counter = Counter(max(0, self.config.max_transitions - planned))
        learner = Learner(self.make_agent, self._milestones(trajectory), counter,
                          self.seeds.child("skills").generator())
        method = METHODS[self.config.method](learner)
        if self.path and self.resumed and (self.path / CHECKPOINT).is_file():
            snapshot, seconds = read_checkpoint(self.path / CHECKPOINT)
            method.restore(snapshot)
            self.began -= seconds
        return method

    def _milestones(self, trajectory: Trajectory | None) -> Milestones:
        if trajectory is None:
            start = self.model.initial_state(self.config.seed)
            return Milestones(np.stack([start, start]), self.model,
                              self.settings.updated({"relative_observations": False}))
        return Milestones.of_plan(trajectory.states, self.model, self.settings)

    def _train(self, method: Method) -> str | None:
        """Step until the method is done; return why it ended early, or None."""
        stop = threading.Event()
        with interruptible(stop.set):
            while not method.done:
                if method.learner.counter.left <= 0:
                    self._checkpoint(method)
                    return (f"the budget of {self.config.max_transitions} transitions is used up, with "
                            f"{method.covered:.0%} of the plan covered")
                self._step(method)
                self._report(method)
                if stop.is_set() or time.perf_counter() - self.last_checkpoint > CHECKPOINT_SECONDS:
                    self._checkpoint(method)
                if stop.is_set():
                    raise KeyboardInterrupt
        return None

    def _step(self, method: Method) -> None:
        try:
            method.step()
        except PbcsError:
            raise
        except Exception as error:
            raise CallbackFailed(f"the environment or the agent raised while training: {error!r}") from error

    def _checkpoint(self, method: Method) -> None:
        if self.path:
            write_checkpoint(self.path / CHECKPOINT, method.snapshot(), time.perf_counter() - self.began)
        self.last_checkpoint = time.perf_counter()

    def _finish(self, method: Method | None, trajectory: Trajectory | None, planned: int,
                stalled: str | None) -> TrainResult:
        seconds = time.perf_counter() - self.began
        chain = SkillChain.of(method.skills, method.learner.milestones) if method and method.skills else None
        nominal = robust = None
        if chain is not None and stalled is None:
            nominal = evaluate(chain, self.model, episodes=1, seed=self.config.seed)
            robust = evaluate(chain, self.model, epsilon=ROBUST_EPSILON, seed=self.config.seed)
        result = TrainResult(
            solved=bool(nominal and robust and nominal.success_rate == 1 and robust.success_rate >= ROBUST_RATE),
            nominal=nominal, robust=robust, chain=chain, trajectory=trajectory,
            milestones=method.learner.milestones.states if method else None, plan_transitions=planned,
            train_transitions=method.learner.counter.count if method else 0,
            updates=method.learner.updates if method else 0, seconds=seconds, seed=self.config.seed,
            out=str(self.path) if self.path else None, stalled=stalled)
        self._write(result)
        return result

    def _write(self, result: TrainResult) -> None:
        if self.folder is None:
            return
        path: Path = self.folder.path
        if result.chain is not None:
            result.chain.save(path / CHAIN)
        self.folder.write_result(result.summary())
        if result.stalled is None:
            (path / CHECKPOINT).unlink(missing_ok=True)

    def _planning(self, numbers: dict[str, Any]) -> None:
        if self.on_progress:
            self.on_progress({"phase": "plan", **numbers})

    def _report(self, method: Method) -> None:
        if self.on_progress is None:
            return
        learner = method.learner
        try:
            self.on_progress({"phase": "train", "transitions": learner.counter.count, "updates": learner.updates,
                              "covered": method.covered, "skills": len(method.skills),
                              "seconds": time.perf_counter() - self.began})
        except KeyboardInterrupt:  # a caller may end a training from here
            self._checkpoint(method)
            raise
