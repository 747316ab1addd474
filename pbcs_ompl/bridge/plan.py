"""Plan in any environment that can be reset, with any planner."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
from ompl import base as ob

from pbcs_ompl.bridge.coverage import Coverage, TransitionRecorder
from pbcs_ompl.bridge.improvement.allowance import Allowance, Improvement
from pbcs_ompl.bridge.improvement.improve import improve as improve_plan
from pbcs_ompl.bridge.planner_spec import PlannerSpec, as_anytime_planner, as_batch_planner
from pbcs_ompl.bridge.problem import CallbackState, Problem, make_problem
from pbcs_ompl.bridge.termination import Limits, checked_limits, make_stop, stop_after_first
from pbcs_ompl.bridge.trajectory import Trajectory, to_trajectory, trajectory_of
from pbcs_ompl.bridge.tree import load_tree, save_tree, tree_of
from pbcs_ompl.bridge.verification import Verification, verify
from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, PbcsError
from pbcs_ompl.core.interfaces import BatchPlanner, ResettableModel
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.signals import interruptible
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Counter, ProgressCallback, Solution
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.adapters.vectorised import VectorisedModel
from pbcs_ompl.resettable.known_goal import check_goal
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.results.checksums import SUMS
from pbcs_ompl.results.files import CONFIG, PROVENANCE, RESULT, TRAJECTORY, TREE, write_errors
from pbcs_ompl.results.folder import RunFolder, read_folder, start_run
from pbcs_ompl.results.provenance import planning_versions


@dataclass(frozen=True, eq=False)
class PlanResult:
    """What one planner found, with its evidence.

    Attributes:
        solved: Whether the plan, executed in a fresh environment by `reset` and `step` alone, reaches the goal.
        found: Whether the planner believes to have reached it; where it is not `solved` then, `reason` says why.
        reason: Why it is not solved; None when it is.
        transitions: Environment steps that the search made, until its first solution.
        collision_checks: How often the environment was asked whether something collides: by every transition, and
            by every state that OMPL made up itself.
        seconds: Wall time of the search alone, without compilation, until its first solution.
        nodes: Size of the tree.
        path_length: Steps of the trajectory; None when none was found.
        replay_ok: Whether the trajectory gave the same states bit for bit in that environment; None when none was
            found, or no fresh environment can be made. False is a failure of the planner, or a sign that the
            environment is not deterministic or has a memory that is not restored.
        planner, env, seed: What was run.
        planner_settings: Every option of the planner with the value in use.
        out: The folder with the files, None when none was asked for.
        trajectory: The path found, solved or not; None when none was.
        tree: What was explored.
        coverage: How much of the feature space was seen after how many transitions; None unless asked for.
        improvement: What making the plan shorter has brought and used beside the search, whose numbers the others are,
            or what a planner has that continues after its first solution (such as SSTCompiled); else None.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.plan("pbcs/Maze-v0", "KPIECE1", seed=0)
        >>> result.path_length == len(result.trajectory.actions)
        True
    """

    solved: bool
    transitions: int
    collision_checks: int
    seconds: float
    nodes: int
    path_length: int | None
    replay_ok: bool | None
    planner: str
    env: str
    seed: int
    out: str | None
    planner_settings: dict[str, Any]
    trajectory: Trajectory | None
    tree: Tree
    found: bool = False
    reason: str | None = None
    coverage: Coverage | None = None
    improvement: Improvement | None = None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words, without settings and arrays."""
        return {"solved": self.solved, "found": self.found, "reason": self.reason, "transitions": self.transitions,
                "collision_checks": self.collision_checks, "seconds": self.seconds, "nodes": self.nodes,
                "path_length": self.path_length, "replay_ok": self.replay_ok, "planner": self.planner,
                "env": self.env, "seed": self.seed, "out": self.out,
                **({} if self.improvement is None else {"improvement": asdict(self.improvement)})}


@checked
def plan(env: str | EnvSpec | gymnasium.Env | ResettableModel, planner: Any = "Rides", *,
         env_kwargs: dict[str, Any] | None = None, planner_kwargs: dict[str, Any] | None = None,
         goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None, start_seed: int | None = None,
         reset_options: dict[str, Any] | None = None, max_episode_steps: int | None = None, seed: int = 0,
         max_transitions: int = 1_000_000, max_seconds: float | None = None, out: str | Path | None = None,
         improve: int | str | None = None, coverage: bool = False,
         on_progress: ProgressCallback | None = None) -> PlanResult:
    """Search a trajectory from the environment's start to its goal.

    A plan counts as solved once it has been executed in a fresh environment and reached the goal there. An unreachable
    goal is no error: the budget ends, `solved` is False, and the tree is there to be looked at.

    Args:
        env: A Gymnasium id, an `EnvSpec`, an environment, or its resettable model.
        planner: A registered name or `module:attribute`, an `ompl.base.Planner` class, or a factory, such as a strategy
            class (see `PlannerSpec`).
        env_kwargs: Options of the environment, when `env` is an id.
        planner_kwargs: Options of the planner.
        goal, feature, start_seed, reset_options, max_episode_steps: See `pbcs_ompl.make`.
        seed: Equal seeds give equal paths.
        max_transitions: The most environment steps.
        max_seconds: The most wall time of the search; None for any.
        out: A new folder for config.toml, result.json, tree.npz and, when solved, trajectory.npz.
        improve: What may be used after the search to make the plan shorter: 5000 transitions, "10%" of those of the
            search, or "2s" of wall time. A planner that continues after its first solution uses it itself; for None,
            all of its budget.
        coverage: Report how much of the feature space was seen after how many transitions, in the result's `coverage`.
        on_progress: Called a few times a second with {"transitions", "seconds"}.

    Raises:
        UnknownName, InvalidOption, InvalidState, NotResettable, UnsupportedSpace: wrong input.
        PlannerUnavailable: the installed OMPL cannot build the planner.
        CallbackFailed: the environment or the strategy raised, or returned NaN.
        RunFolderError: `out` exists, is in use, or cannot be written.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs={"size": 3}, seed=0)
        >>> result.solved, result.replay_ok
        (True, True)
    """
    limits = checked_limits(max_transitions, max_seconds)
    allowance = None if improve is None else Allowance.of(improve)
    model = make(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed, reset_options=reset_options,
                 max_episode_steps=max_episode_steps)
    check_goal(model)
    spec = PlannerSpec(planner, planner_kwargs or {})
    config = {"kind": "plan", "planner": spec.name, "seed": seed, **limits._asdict(),
              "environment": model.spec.to_dict(), "planner_kwargs": spec.options, "versions": planning_versions(),
              **({} if improve is None else {"improve": improve})}
    with _new_folder(out, config) as folder:
        _warm_up(model, spec, planner)
        recorder = TransitionRecorder(model) if coverage else None
        with quiet_ompl(), make_problem(model, seed=seed, counter=Counter(limits.max_transitions),
                                        recorder=recorder) as problem:
            found = _search(problem, spec, seed, limits, allowance, on_progress)
        trajectory, improvement, verdict = _judged(found, model, allowance, seed)
        transitions = found.until_first.transitions
        result = PlanResult(
            solved=verdict.solved, found=trajectory is not None, reason=verdict.reason, transitions=transitions,
            collision_checks=transitions + problem.callbacks.validity_checks, seconds=found.until_first.seconds,
            nodes=len(found.tree), path_length=None if trajectory is None else trajectory.length,
            replay_ok=verdict.replays, planner=spec.name, env=model.spec.id, seed=seed, improvement=improvement,
            out=None if out is None else str(out),
            planner_settings=found.settings, trajectory=trajectory, tree=found.tree,
            coverage=None if recorder is None else recorder.coverage(found.tree, found.transitions, found.seconds))
        if folder is not None:
            _write(folder, result, config)
    return result


def read_plan(folder: str | Path) -> PlanResult:
    """Return the result that a plan has left in a folder.

    Raises:
        DamagedFile: there is none, or a file is damaged.
    """
    path = Path(folder)
    found = read_folder(path)
    trajectory = Trajectory.load(path / TRAJECTORY) if (path / TRAJECTORY).exists() else None
    try:
        numbers = dict(found.result or {})
        improvement = Improvement(**numbers.pop("improvement")) if "improvement" in numbers else None
        return PlanResult(**numbers, trajectory=trajectory, tree=load_tree(path / TREE), improvement=improvement,
                          planner_settings=found.config.get("planner_kwargs", {}))
    except TypeError as error:
        raise DamagedFile(f"{path / RESULT} is not the result of a plan: {error}") from error


def _judged(found: "_Found", model: ResettableModel, allowance: Allowance | None,
            seed: int) -> tuple[Trajectory | None, Improvement | None, Verification]:
    """Return the plan, shorter where that is asked for and the environment grants the shorter one, and the verdict.

    A search that continued after its first solution has used the allowance itself.
    """
    given = found.trajectory
    if given is None:
        return None, None, NOTHING_FOUND
    if found.continued:
        return given, Improvement.of_search(found.solutions, found.transitions, found.seconds), verify(given, model)
    if allowance is None or allowance.nothing:
        return given, None, verify(given, model)
    shorter, improvement = improve_plan(given, model, allowance.after(found.transitions), seed=seed, tree=found.tree)
    verdict = verify(shorter, model)
    if verdict.solved or shorter is given:
        return shorter, improvement, verdict
    return given, replace(improvement, after=given.length), verify(given, model)


PARTS = (TRAJECTORY, TREE)
NOTHING_FOUND = Verification(False, None, "the budget ended before the goal was reached")


WARM_UP = Limits(64, 1.0)
TOY = "pbcs/Toy1D-v0"
_warm: set[tuple[str, str]] = set()
"""The planners and environments whose code this process has compiled."""


def _warm_up(model: ResettableModel, spec: PlannerSpec, planner: Any) -> None:
    """Search for a moment, so that the reported seconds are those of the search and not of a compiler.

    The search is one in the model where its steps are functions of batches, which may be compiled and leave nothing
    behind; else one in a toy, because an environment that is stepped makes no steps beyond its budget.
    """
    pure = isinstance(model, VectorisedModel)
    key = (spec.name, model.spec.id if pure else TOY)
    if key in _warm:
        return
    _warm.add(key)
    with suppress(PbcsError):  # what is wrong is raised by the search itself
        toy = model if pure else make(TOY)
        small = spec if pure else PlannerSpec(planner, {})
        with quiet_ompl(), make_problem(toy, counter=Counter(WARM_UP.max_transitions)) as problem:
            _search(problem, small, 0, WARM_UP, None, None)


class _Found(NamedTuple):
    """What a search leaves: the trajectory (None when the goal was not reached), the tree, the planner's settings."""

    trajectory: Trajectory | None
    tree: Tree
    settings: dict[str, Any]
    transitions: int
    seconds: float
    solutions: Sequence[Solution]

    @property
    def continued(self) -> bool:
        """Whether the search continued after its first solution."""
        return len(self.solutions) > 0 and self.solutions[0].transitions < self.transitions

    @property
    def until_first(self) -> Solution:
        """What the search took until its first solution, or in all."""
        return self.solutions[0] if self.continued else Solution(self.transitions, self.seconds, 0)


def _search(problem: Problem, spec: PlannerSpec, seed: int, limits: Limits, allowance: Allowance | None,
            on_progress: ProgressCallback | None) -> _Found:
    setup, callbacks = problem.setup, problem.callbacks
    with code_of_others(f"the planner {spec.name!r}"):
        planner = spec.build(problem.space_information, SeedTree(seed).child("planner").integer())
        batch_planner = as_batch_planner(planner)
        if batch_planner is not None:
            batch_planner.use_model(problem.model, callbacks.counter)
        setup.setPlanner(planner)
        setup.setup()
    stop = make_stop(callbacks, limits.max_seconds, on_progress)
    anytime = as_anytime_planner(planner)
    if anytime is not None and allowance is not None:
        stop = stop_after_first(stop, anytime, callbacks.counter, allowance)
    if callbacks.recorder is not None:
        stop = callbacks.recorder.timed(stop, callbacks.counter)
    with interruptible(callbacks.fail):
        began = time.perf_counter()
        with code_of_others():
            planner.solve(ob.PlannerTerminationCondition(stop))
        seconds = time.perf_counter() - began
    if batch_planner is not None:
        _keep_error(batch_planner, callbacks)
    callbacks.raise_error()
    with code_of_others(f"the planner {spec.name!r}"):
        tree = tree_of(planner, problem.space_information)
        return _Found(_solution(problem, batch_planner, spec, seed), tree, spec.settings(planner),
                      callbacks.counter.count, seconds, anytime.solutions if anytime is not None else [])


def _keep_error(planner: BatchPlanner, callbacks: CallbackState) -> None:
    """Pass on the planner's error, without a variable in the frame that raises it: the two would keep each other."""
    error = planner.error
    if error is not None:
        callbacks.fail(error)


def _solution(problem: Problem, planner: BatchPlanner | None, spec: PlannerSpec, seed: int) -> Trajectory | None:
    """Return the planner's path if it ends in the goal: planners also report approximate ones."""
    setup, model = problem.setup, problem.model
    if not setup.haveExactSolutionPath():
        return None
    source: dict[str, Any] = {"planner": spec.name, "seed": seed, "reset_seed": model.spec.reset_seed(seed)}
    if planner is not None and planner.tree is not None and planner.solution is not None:
        trajectory = trajectory_of(planner.tree, planner.solution, model, **source)
    else:
        trajectory = to_trajectory(setup.getSolutionPath(), problem.space_information, model, **source)
    reached = model.goal_distance(trajectory.states[-1:])[0] < model.goal_threshold
    return trajectory if reached else None


@contextmanager
def _new_folder(out: str | Path | None, config: dict[str, Any]) -> Iterator[RunFolder | None]:
    """Open the result folder, and write its settings; when the run fails, remove what it has written."""
    if out is None:
        yield None
        return
    with write_errors(Path(out)):
        existed = Path(out).exists()
    with start_run(Path(out), config, may_change=("planner_kwargs", "versions"), parts=PARTS) as folder:
        try:
            yield folder
            return
        except BaseException:
            for name in (*PARTS, CONFIG, PROVENANCE, RESULT, SUMS):
                (folder.path / name).unlink(missing_ok=True)
            folder.close()
            if not existed:
                with suppress(OSError):  # others have removed it, or put something there
                    folder.path.rmdir()
            raise


def _write(folder: RunFolder, result: PlanResult, config: dict[str, Any]) -> None:
    if result.trajectory is not None:
        result.trajectory.save(folder.path / TRAJECTORY)
    save_tree(result.tree, folder.path / TREE)
    folder.write_config(config | {"planner_kwargs": result.planner_settings})
    folder.write_result(result.summary())
