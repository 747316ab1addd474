"""One training: plan, train skills along the plan, evaluate; it can be stopped and resumed after every step."""

import time
from copy import deepcopy
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.bridge.plan import PlanResult, plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.verification import verify
from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.errors import BudgetUsedUp, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.signals import interruptible
from pbcs_ompl.core.types import Counter, ProgressCallback
from pbcs_ompl.results.checksums import write_summed_json
from pbcs_ompl.results.files import CHAIN, CHECKPOINT, CONFIG, PLAN, TRAJECTORY, is_there, read_json, read_toml
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.results.progress import PROGRESS, ProgressLog
from pbcs_ompl.results.provenance import planning_versions
from pbcs_ompl.results.schema import PlanEffort
from pbcs_ompl.skills.config import METHODS, TrainConfig
from pbcs_ompl.skills.criterion import Outcome, judged
from pbcs_ompl.skills.method import TrainingMethod, restore, write_checkpoint
from pbcs_ompl.skills.path_following.shown_feature import how_to_show, observes_feature
from pbcs_ompl.skills.settings import PlannedSettings, PlanSettings
from pbcs_ompl.skills.train_result import TrainResult
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

FIRST_CHECKPOINT_SECONDS, CHECKPOINT_SECONDS = 3.0, 30.0
"""Wall time to the first checkpoint and between later ones; it does not change the result."""
CONTINUED = {"Rides": "RidesSST"}
"""The planner that finds what another one finds, and then continues its search for shorter plans."""
SHORTER = 0.9
"""The part of a plan's steps, at most, that is left where making it shorter is worth its transitions."""
WARM_UP_ROWS = 256
"""Transitions of a first update."""


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
        self.began = time.perf_counter()
        self.next_checkpoint = self.began + FIRST_CHECKPOINT_SECONDS
        self.log: ProgressLog | None = None
        self.undone = 0
        """Transitions of a step that was undone because the budget ended in it."""

    def run(self, trajectory: Trajectory | None) -> TrainResult:
        """Plan (or take the plan that is given or was made before), train, evaluate and write."""
        with one_thread():
            self._warm_up()
            return self._run(trajectory)

    def _warm_up(self) -> None:
        """Make an update of an agent that is thrown away: the reported seconds are not those of a compiler."""
        agent, spaces = self.config.agent_factory(self.model)(0), self.settings.agent_spaces(self.model)
        observations = np.zeros((1, WARM_UP_ROWS, spaces.observation_size))
        actions = np.tile(spaces.action_low, (1, WARM_UP_ROWS, 1))
        rewards, terminals = np.zeros((1, WARM_UP_ROWS)), np.zeros((1, WARM_UP_ROWS), dtype=np.bool_)
        with code_of_others("the agent"):
            agent.add_transitions(observations, actions, rewards, observations, terminals)
            agent.train(1)
        self.began = time.perf_counter()
        self.next_checkpoint = self.began + FIRST_CHECKPOINT_SECONDS

    def _run(self, trajectory: Trajectory | None) -> TrainResult:
        if self.folder and not self.resumed:
            self.folder.write_config({"kind": "train", **self.config.to_dict(),
                                      "environment": self.model.spec.to_dict(), "versions": training_versions()})
        if self.path:
            self.log = ProgressLog(self.path / PROGRESS)
        trajectory, planned, failure = self._plan(trajectory)
        if failure is not None and isinstance(self.settings, PlannedSettings):
            return self._finish(None, trajectory, planned, failure)
        if trajectory is not None and not trajectory.length:
            return self._finish(None, trajectory, planned, None)
        try:
            method = self._method(trajectory, planned)
        except BudgetUsedUp:
            return self._finish(None, trajectory, planned, "the budget is used up before training begins")
        return self._finish(method, trajectory, planned, *self._judged_training(method, trajectory))

    def _plan(self, trajectory: Trajectory | None) -> tuple[Trajectory | None, int, str | None]:
        """Return the plan, the transitions it took, and why there is none to train along."""
        if self.path and self.resumed and is_there(self.path / PLAN):
            trajectory = Trajectory.load(self.path / TRAJECTORY)
            self._check_replays(trajectory)
            return trajectory, read_json(self.path / PLAN, PlanEffort)["transitions"], None
        if self.config.planner is not None:
            return self._search()
        if trajectory is not None:
            self._check_replays(trajectory)
            self._keep_plan(trajectory, 0)
        return trajectory, 0, None

    def _search(self) -> tuple[Trajectory | None, int, str | None]:
        settings = self.settings.plan if isinstance(self.settings, PlannedSettings) else PlanSettings()
        found = self._searched(str(self.config.planner), self.config.planner_kwargs, settings.improve)
        transitions = _made(found)
        if self.folder:
            config = read_toml(self.folder.path / CONFIG)
            self.folder.write_config(config | {"planner_kwargs": found.planner_settings})
        if self._continues(found, settings.search_on, transitions):
            further = self._searched(CONTINUED[found.planner], {}, settings.search_on, transitions)
            transitions += _made(further)
            if further.solved and _steps(further) < _steps(found):
                found = further
        unverified = found.found and found.replay_ok is None
        if not (found.solved or unverified):
            reason = found.reason if found.found else "the planner found no path to the goal within the budget"
            return None, transitions, reason
        if found.trajectory is not None:
            self._keep_plan(found.trajectory, transitions)
        return found.trajectory, transitions, None

    def _searched(self, planner: str, options: dict[str, Any], share: float, used: int = 0) -> PlanResult:
        """Return a plan, made shorter with a share of the transitions of its search, after some are used."""
        return plan(self.model, planner, planner_kwargs=options, seed=self.seeds.child("plan").integer(),
                    max_transitions=self.config.max_transitions - used, improve=f"{100 * share:g}%",
                    on_progress=self._report_planning)

    def _continues(self, found: PlanResult, share: float, used: int) -> bool:
        """Return whether the search continues: making the plan shorter saved little, and the budget allows it."""
        shorter = found.improvement
        return (share > 0.0 and found.solved and shorter is not None and shorter.after > SHORTER * shorter.before
                and found.planner in CONTINUED and not self.config.planner_kwargs
                and bool(np.isfinite([self.model.feature_low, self.model.feature_high]).all())
                and used + (1.0 + share) * found.transitions < self.config.max_transitions)

    def _keep_plan(self, trajectory: Trajectory, transitions: int) -> None:
        if self.path:
            trajectory.save(self.path / TRAJECTORY)
            write_summed_json(self.path / PLAN, {"transitions": transitions})

    def _check_replays(self, trajectory: Trajectory) -> None:
        """Refuse a trajectory that is not true here; the replay also visits its states, where only those are restored.

        Raises:
            Mismatch: it belongs to another environment, leads elsewhere in this one, or does not reach the goal.
        """
        trajectory.check_belongs_to(self.model)
        with code_of_others("the environment, while the trajectory was replayed,"):
            same = trajectory.replays_exactly(self.model)
        if not same:
            raise Mismatch("the trajectory does not replay in this environment: its actions lead to other states")
        verdict = verify(trajectory, self.model)
        unverified = verdict.replays is None
        if not verdict.solved and not (unverified and self._reaches_goal(trajectory)):
            raise Mismatch(f"the trajectory does not end in the environment's goal: {verdict.reason}")

    def _reaches_goal(self, trajectory: Trajectory) -> bool:
        return bool(self.model.goal_distance(trajectory.states[-1:])[0] < self.model.goal_threshold)

    def _method(self, trajectory: Trajectory | None, planned: int) -> TrainingMethod:
        """Return the training method, as new or as the checkpoint left it."""
        counter = Counter(max(0, self.config.max_transitions - planned))
        trainer = SkillTrainer(self.config.agent_factory(self.model), self._waypoints(trajectory),
                               self.settings.episodes, counter, self.seeds.child("skills").generator())
        method = METHODS[self.config.method].build(trainer, self.settings)
        if self.path and self.resumed and is_there(self.path / CHECKPOINT):
            self.began -= restore(method, self.path / CHECKPOINT)
        return method

    def _waypoints(self, trajectory: Trajectory | None) -> Waypoints:
        if isinstance(self.settings, PlannedSettings) and trajectory is not None:
            return Waypoints.of_plan(trajectory.states, self.model, self.settings, trajectory.reset_seed)
        return Waypoints.at_start(self.config.seed, self.model, self.settings.starts)

    def _judged_training(self, method: TrainingMethod, trajectory: Trajectory | None) -> tuple[str | None, Outcome]:
        """Train; train on where the judge refuses the chain, and the model agrees, as long as the budget lasts.

        The executions of a judge that is not the last one count as training; each has random actions of its own.

        Returns:
            Why training ended early, or None, and what it came to.
        """
        counter = method.trainer.counter
        while (ended_early := self._train(method)) is None:
            outcome = self._judge(method, trajectory)
            if (outcome.reason is None or not outcome.is_believed or counter.left <= outcome.transitions
                    or not method.refused()):
                return None, outcome
            counter.spend(outcome.transitions)
        return ended_early, Outcome(ended_early)

    def _judge(self, method: TrainingMethod | None, trajectory: Trajectory | None) -> Outcome:
        chain = None if method is None else method.chain(self.settings.steps_per_skill)
        times = 0 if method is None else method.refusals
        seed = self.seeds.child(f"judge {times}").integer() if times else self.config.seed
        return judged(chain, trajectory, self.model, self.settings.criterion, seed)

    def _train(self, method: TrainingMethod) -> str | None:
        """Step until the method is done; return why it ended early, or None."""
        stops: list[KeyboardInterrupt] = []
        with interruptible(stops.append):
            while not method.done:
                if not self._step(method):
                    self._checkpoint(method)
                    return (f"the budget of {self.config.max_transitions} transitions is used up, with "
                            f"{method.standing}. {self._advice()}")
                self._report(method)
                if stops or time.perf_counter() > self.next_checkpoint:
                    self._checkpoint(method)
                if stops:
                    raise stops[0]
        return None

    def _advice(self) -> str:
        """Return what to try when the budget is used up."""
        other = "the method 'pbcs'" if self.config.method == "follow" else "the method 'follow'"
        if self.config.method != "follow" and not observes_feature(self.model):
            other = f"to follow the path: {how_to_show(self.model)}"
        return f"Try a larger budget (a folder can be resumed), another seed, another plan, or {other}"

    def _step(self, method: TrainingMethod) -> bool:
        """Make one step of the method; return whether the budget allowed it.

        A step that needs more than is left is undone, so that a training that is resumed with a larger budget does what
        it would have done with that budget from the beginning.
        """
        counter, before = method.trainer.counter, None
        if counter.left < method.longest_step:
            before = deepcopy(method.snapshot())
        try:
            with code_of_others("the environment or the agent"):
                if counter.left > 0:
                    method.step()
                    return True
        except BudgetUsedUp:
            self.undone = counter.count
            if before is not None:
                method.restore(before)
            self.undone -= counter.count
        return False

    def _checkpoint(self, method: TrainingMethod) -> None:
        if self.path:
            write_checkpoint(self.path / CHECKPOINT, method.snapshot(), time.perf_counter() - self.began)
        self.next_checkpoint = time.perf_counter() + CHECKPOINT_SECONDS

    def _finish(self, method: TrainingMethod | None, trajectory: Trajectory | None, planned: int,
                ended_early: str | None, outcome: Outcome | None = None) -> TrainResult:
        seconds = time.perf_counter() - self.began
        if method is not None:
            self._report(method, last=True)
        chain = None if method is None else method.chain(self.settings.steps_per_skill)
        if outcome is None:
            outcome = Outcome(ended_early) if ended_early else self._judge(method, trajectory)
        result = TrainResult(
            solved=outcome.reason is None, reason=outcome.reason, complete=ended_early is None, nominal=outcome.nominal,
            robust=outcome.robust, model_success_rate=outcome.model_success_rate, chain=chain, trajectory=trajectory,
            waypoints=method.trainer.waypoints.states if method else None, plan_transitions=planned,
            train_transitions=method.trainer.counter.count + self.undone if method else 0,
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
        if self.log:
            self.log({"phase": "plan", **numbers})
        if self.on_progress:
            self.on_progress({"phase": "plan", **numbers})

    def _report(self, method: TrainingMethod, *, last: bool = False) -> None:
        numbers = self._numbers(method)
        if self.log:
            self.log(numbers, last=last)
        if self.on_progress is None or last:
            return
        try:
            with code_of_others("on_progress"):
                self.on_progress(numbers)
        except KeyboardInterrupt:  # a caller may end a training from here
            self._checkpoint(method)
            raise

    def _numbers(self, method: TrainingMethod) -> dict[str, Any]:
        """Return how far training has come, as plain numbers."""
        trainer = method.trainer
        return {"phase": "train", "transitions": trainer.counter.count, "updates": trainer.updates,
                "covered": method.covered, "skills": len(method.skills), **trainer.latest,
                "seconds": time.perf_counter() - self.began}


def _made(found: PlanResult) -> int:
    """Return the transitions of a search and of what made its plan shorter."""
    return found.transitions + (found.improvement.transitions if found.improvement else 0)


def _steps(found: PlanResult) -> float:
    """Return the steps of a plan."""
    return float("inf") if found.path_length is None else found.path_length


def training_versions() -> dict[str, str]:
    """Return the versions of packages that a training depends on."""
    return planning_versions() | {"torch": version("torch")}
