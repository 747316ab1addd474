"""One training: plan, train skills along the plan, evaluate; it can be stopped and resumed after every step."""

import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.errors import Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.signals import interruptible
from pbcs_ompl.core.types import Array, Counter, ProgressCallback
from pbcs_ompl.results.files import CHAIN, CHECKPOINT, CONFIG, PLAN, TRAJECTORY, read_json, read_toml, write_json
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.results.provenance import planning_versions
from pbcs_ompl.skills.chain import SkillChain
from pbcs_ompl.skills.config import METHODS, TrainConfig
from pbcs_ompl.skills.evaluation import Evaluation, evaluate
from pbcs_ompl.skills.method import TrainingMethod, read_checkpoint, write_checkpoint
from pbcs_ompl.skills.settings import CriterionSettings, PlannedSettings
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

CHECKPOINT_SECONDS = 30.0
"""Wall time between checkpoints; it does not change the result."""


@dataclass(frozen=True, eq=False)
class TrainResult:
    """The result of a training with its evidence.

    Attributes:
        solved: The chain reaches the goal from the start without noise, and in at least 95 of 100 executions in
            which a tenth of the actions is random (see `CriterionSettings`).
        reason: Why it is not solved; None when it is.
        complete: Whether the method ended by itself; False when its budget or the planner's search ended first.
        nominal, robust: The two evaluations that decide `solved`; None when training is not complete.
        chain: The skills; None when there are none.
        trajectory: The plan; None for methods without one, or when none was found.
        waypoints: The states along which skills were trained [N+1, D]; None without a plan.
        plan_transitions, train_transitions: Environment steps of the two phases; evaluations are not counted.
        updates: Gradient steps.
        seconds: Wall time of planning and training.
        seed: Root of all random streams.
        out: The folder; None when none was asked for.
    """

    solved: bool
    reason: str | None
    complete: bool
    nominal: Evaluation | None
    robust: Evaluation | None
    chain: SkillChain | None
    trajectory: Trajectory | None
    waypoints: Array | None
    plan_transitions: int
    train_transitions: int
    updates: int
    seconds: float
    seed: int
    out: str | None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words; `success_rate` and `wilson` are those of the noisy executions."""
        robust, nominal = self.robust, self.nominal
        return {"solved": self.solved, "reason": self.reason, "complete": self.complete,
                "success_rate": robust.success_rate if robust else 0.0,
                "wilson": list(robust.wilson) if robust else None,
                "nominal_success_rate": nominal.success_rate if nominal else 0.0,
                "steps_median": nominal.steps_median if nominal else None,
                "skills": len(self.chain.skills) if self.chain else 0,
                "plan_transitions": self.plan_transitions, "train_transitions": self.train_transitions,
                "updates": self.updates, "seconds": self.seconds, "seed": self.seed, "out": self.out}


class Training:
    """A run: its configuration, its folder (if any), its clock.

    Args:
        model: The environment.
        config: All that the result depends on beside it.
        folder: Where results and checkpoints are written; None for nowhere.
        on_progress: Called after every step with plain numbers.
        resumed: Continue from what the folder holds.
    """

    def __init__(self, model: ResettableModel, config: TrainConfig, folder: RunFolder | None,
                 on_progress: ProgressCallback | None, resumed: bool):
        self.model, self.config, self.on_progress = model, config, on_progress
        self.folder = folder
        self.path = folder.path if folder else None
        self.resumed = resumed
        self.settings = config.settings
        self.seeds = SeedTree(config.seed)
        self.began = self.last_checkpoint = time.perf_counter()

    def run(self, trajectory: Trajectory | None) -> TrainResult:
        """Plan (or take the plan that is given or was made before), train, evaluate and write."""
        with one_thread():
            return self._run(trajectory)

    def _run(self, trajectory: Trajectory | None) -> TrainResult:
        if self.folder and not self.resumed:
            self.folder.write_config({"kind": "train", **self.config.to_dict(),
                                      "environment": self.model.spec.to_dict(), "versions": training_versions()})
        trajectory, planned = self._plan(trajectory)
        if trajectory is None and isinstance(self.settings, PlannedSettings):
            return self._finish(None, None, planned, "the planner found no path to the goal within the budget")
        method = self._method(trajectory, planned)
        return self._finish(method, trajectory, planned, self._train(method))

    def _plan(self, trajectory: Trajectory | None) -> tuple[Trajectory | None, int]:
        """Return the plan and the transitions it took."""
        if self.path and self.resumed and (self.path / PLAN).is_file():
            trajectory = Trajectory.load(self.path / TRAJECTORY)
            self._check_replays(trajectory)
            return trajectory, read_json(self.path / PLAN)["transitions"]
        transitions = 0
        if self.config.planner is not None:
            found = plan(self.model, self.config.planner, planner_kwargs=self.config.planner_kwargs,
                         seed=self.seeds.child("plan").integer(), max_transitions=self.config.max_transitions,
                         on_progress=self._report_planning)
            trajectory, transitions = found.trajectory, found.transitions
            if trajectory is not None and not trajectory.length:
                raise Mismatch("the start is in the goal, so there is nothing to train")
            if self.folder:
                config = read_toml(self.folder.path / CONFIG)
                self.folder.write_config(config | {"planner_kwargs": found.planner_settings})
        elif trajectory is not None:
            self._check_replays(trajectory)
            if not self._reaches_goal(trajectory):
                raise Mismatch("the trajectory does not end in the environment's goal")
        if self.path and trajectory is not None:
            trajectory.save(self.path / TRAJECTORY)
            write_json(self.path / PLAN, {"transitions": transitions})
        return trajectory, transitions

    def _check_replays(self, trajectory: Trajectory) -> None:
        """Refuse a trajectory of another environment; the replay also visits its states, where only those are restored.

        Raises:
            Mismatch: it belongs to another environment, or leads elsewhere in this one.
        """
        trajectory.check_belongs_to(self.model)
        if not trajectory.length:
            raise Mismatch("the trajectory has no steps: the start is in the goal, so there is nothing to train")
        with code_of_others("the environment, while the trajectory was replayed,"):
            same = trajectory.replays_exactly(self.model)
        if not same:
            raise Mismatch("the trajectory does not replay in this environment: its actions lead to other states")

    def _reaches_goal(self, trajectory: Trajectory) -> bool:
        return bool(self.model.goal_distance(trajectory.states[-1:])[0] < self.model.goal_threshold)

    def _method(self, trajectory: Trajectory | None, planned: int) -> TrainingMethod:
        """Return the training method, as new or as the checkpoint left it."""
        counter = Counter(max(0, self.config.max_transitions - planned))
        trainer = SkillTrainer(self.config.agent_factory(self.model), self._waypoints(trajectory),
                               self.settings.episodes, counter, self.seeds.child("skills").generator())
        method = METHODS[self.config.method].build(trainer, self.settings)
        if self.path and self.resumed and (self.path / CHECKPOINT).is_file():
            snapshot, seconds = read_checkpoint(self.path / CHECKPOINT)
            method.restore(snapshot)
            self.began -= seconds
        return method

    def _waypoints(self, trajectory: Trajectory | None) -> Waypoints:
        if isinstance(self.settings, PlannedSettings) and trajectory is not None:
            return Waypoints.of_plan(trajectory.states, self.model, self.settings)
        return Waypoints.at_start(self.model.initial_state(self.config.seed), self.model, self.settings.starts)

    def _train(self, method: TrainingMethod) -> str | None:
        """Step until the method is done; return why it ended early, or None."""
        stops: list[KeyboardInterrupt] = []
        with interruptible(stops.append):
            while not method.done:
                if method.trainer.counter.left <= 0:
                    self._checkpoint(method)
                    return (f"the budget of {self.config.max_transitions} transitions is used up, with "
                            f"{method.covered:.0%} of the plan covered")
                with code_of_others("the environment or the agent"):
                    method.step()
                self._report(method)
                if stops or time.perf_counter() - self.last_checkpoint > CHECKPOINT_SECONDS:
                    self._checkpoint(method)
                if stops:
                    raise stops[0]
        return None

    def _checkpoint(self, method: TrainingMethod) -> None:
        if self.path:
            write_checkpoint(self.path / CHECKPOINT, method.snapshot(), time.perf_counter() - self.began)
        self.last_checkpoint = time.perf_counter()

    def _finish(self, method: TrainingMethod | None, trajectory: Trajectory | None, planned: int,
                ended_early: str | None) -> TrainResult:
        seconds, criterion = time.perf_counter() - self.began, self.settings.criterion
        chain = nominal = robust = None
        if method is not None and method.skills:
            chain = SkillChain.of(method.skills, method.trainer.waypoints, self.settings.steps_per_skill)
        if chain is not None and ended_early is None:
            nominal = evaluate(chain, self.model, episodes=1, seed=self.config.seed)
            robust = evaluate(chain, self.model, episodes=criterion.robust_episodes, epsilon=criterion.robust_epsilon,
                              seed=self.config.seed)
        reason = ended_early or _failure(nominal, robust, criterion)
        result = TrainResult(
            solved=reason is None, reason=reason, complete=ended_early is None, nominal=nominal, robust=robust,
            chain=chain, trajectory=trajectory, waypoints=method.trainer.waypoints.states if method else None,
            plan_transitions=planned, train_transitions=method.trainer.counter.count if method else 0,
            updates=method.trainer.updates if method else 0, seconds=seconds, seed=self.config.seed,
            out=str(self.path) if self.path else None)
        self._write(result)
        return result

    def _write(self, result: TrainResult) -> None:
        if self.folder is None:
            return
        path: Path = self.folder.path
        if result.chain is not None:
            result.chain.save(path / CHAIN)
        self.folder.write_result(result.summary())
        if result.complete:
            (path / CHECKPOINT).unlink(missing_ok=True)

    def _report_planning(self, numbers: dict[str, Any]) -> None:
        if self.on_progress:
            self.on_progress({"phase": "plan", **numbers})

    def _report(self, method: TrainingMethod) -> None:
        if self.on_progress is None:
            return
        trainer = method.trainer
        try:
            with code_of_others("on_progress"):
                self.on_progress({"phase": "train", "transitions": trainer.counter.count, "updates": trainer.updates,
                                  "covered": method.covered, "skills": len(method.skills),
                                  "seconds": time.perf_counter() - self.began})
        except KeyboardInterrupt:  # a caller may end a training from here
            self._checkpoint(method)
            raise


def training_versions() -> dict[str, str]:
    """Return the versions of packages that a training depends on."""
    return planning_versions() | {"torch": version("torch")}


def _failure(nominal: Evaluation | None, robust: Evaluation | None, criterion: CriterionSettings) -> str | None:
    """Return why a complete training does not meet the criterion of a solved one; None when it does."""
    if nominal is None or robust is None:
        return "there is no skill"
    if nominal.success_rate < 1:
        return "the chain does not reach the goal without noise"
    if robust.success_rate < criterion.robust_rate:
        return (f"{robust.successes} of {robust.episodes} executions with {robust.epsilon:.0%} random actions succeed, "
                f"expected {criterion.robust_rate:.0%}")
    return None
