"""Plan in any environment that can be reset anywhere, with any planner."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import gymnasium
from ompl import base as ob

from pbcs_ompl.bridge.building import PlannerSpec
from pbcs_ompl.bridge.coverage import Trace
from pbcs_ompl.bridge.path import to_trajectory
from pbcs_ompl.bridge.problem import Problem, make_problem, quiet_ompl
from pbcs_ompl.bridge.result import PlanResult
from pbcs_ompl.bridge.stopping import Limits, checked_limits, interruptible, make_stop
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.tree import TreeArrays, tree_of
from pbcs_ompl.bridge.versions import planning_versions
from pbcs_ompl.bridge.watch import failure
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.interfaces import BatchPlanner, ResettableModel
from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Counter, ProgressCallback
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.results.folder import CONFIG, PROVENANCE, RESULT, RunFolder

TRAJECTORY = "trajectory.npz"
TREE = "tree.npz"


@runtime_checkable
class HoldsError(Protocol):
    """A planner that keeps an exception of its strategy instead of raising it through OMPL."""

    @property
    def error(self) -> Any: ...


def plan(env: str | EnvSpec | gymnasium.Env | ResettableModel, planner: Any = "Ex", *,
         env_kwargs: dict[str, Any] | None = None, planner_kwargs: dict[str, Any] | None = None,
         goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None, start_seed: int | None = None,
         seed: int = 0, max_transitions: int = 1_000_000, max_seconds: float | None = None,
         out: str | Path | None = None, coverage: bool = False,
         on_progress: ProgressCallback | None = None) -> PlanResult:
    """Search a trajectory from the environment's start to its goal.

    Only an exact solution counts as solved, and the trajectory is replayed in a fresh environment to see
    whether it is true. An unreachable goal is no error: the budget ends, `solved` is False, and the tree is
    there to be looked at.

    Args:
        env: A Gymnasium id, an `EnvSpec`, an environment, or its resettable model.
        planner: A registered name, `module:attribute`, an `ompl.base.Planner` class, or a factory
            (a strategy class is one).
        env_kwargs: Options of the environment, when `env` is an id.
        planner_kwargs: Options of the planner.
        goal, feature, start_seed: See `pbcs_ompl.make`.
        seed: Equal seeds give equal paths.
        max_transitions: The most environment steps.
        max_seconds: The most wall time of the search; None for any.
        out: A new folder for config.toml, result.json, tree.npz and, when solved, trajectory.npz.
        coverage: Tell how much of the feature space was seen after how many transitions, in the result's `coverage`.
        on_progress: Called a few times a second with {"transitions", "seconds"}.

    Raises:
        UnknownName, InvalidOption, InvalidState, NotResettable, UnsupportedSpace: wrong input.
        PlannerUnavailable: the installed OMPL cannot build the planner.
        CallbackFailed: the environment or the strategy raised, or returned NaN.
        RunFolderError: `out` exists, is in use, or cannot be written.
    """
    limits = checked_limits(max_transitions, max_seconds)
    model = make(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed)
    spec = PlannerSpec(planner, planner_kwargs or {})
    with _new_folder(out) as folder:
        counter = Counter(limits.max_transitions)
        trace = Trace(model) if coverage else None
        with quiet_ompl(), make_problem(model, seed=seed, counter=counter, trace=trace) as problem:
            trajectory, tree, seconds = _search(problem, spec, seed, limits, on_progress)
        result = PlanResult(
            solved=trajectory is not None, transitions=counter.count,
            collision_checks=counter.count + problem.watch.validity_checks, seconds=seconds, nodes=len(tree.states),
            path_length=None if trajectory is None else trajectory.length,
            replay_ok=None if trajectory is None else trajectory.replays_exactly(_fresh(model)),
            planner=spec.name, env=model.spec.id, seed=seed, out=None if out is None else str(out),
            trajectory=trajectory, tree=tree,
            coverage=None if trace is None else trace.coverage(tree, counter.count, seconds))
        if folder is not None:
            _write(folder, result, model, spec, limits)
    return result


def _search(problem: Problem, spec: PlannerSpec, seed: int, limits: Limits,
            on_progress: ProgressCallback | None) -> tuple[Trajectory | None, TreeArrays, float]:
    """Return the trajectory (None when the goal was not reached), the tree, and the seconds of the search."""
    setup, model, watch = problem.setup, problem.model, problem.watch
    planner = spec.build(problem.space_information, SeedTree(seed).child("planner").integer())
    if isinstance(planner, BatchPlanner):
        planner.use_model(model, watch.counter)
    setup.setPlanner(planner)
    setup.setup()
    stop = make_stop(watch, limits.max_seconds, on_progress)
    if watch.trace is not None:
        stop = watch.trace.timed(stop, watch.counter)
    with interruptible(lambda: watch.fail(KeyboardInterrupt())):
        began = time.perf_counter()
        try:
            planner.solve(ob.PlannerTerminationCondition(stop))
        except PbcsError:
            raise
        except Exception as error:
            raise failure(error) from error
        seconds = time.perf_counter() - began
    if isinstance(planner, HoldsError) and isinstance(planner.error, BaseException):
        watch.fail(planner.error)
    watch.raise_error()
    tree = tree_of(planner, model, problem.space_information)
    return _solution(problem, spec, seed), tree, seconds


def _solution(problem: Problem, spec: PlannerSpec, seed: int) -> Trajectory | None:
    """Return the planner's path if it ends in the goal: planners also hand out approximate ones."""
    setup, model = problem.setup, problem.model
    if not setup.haveExactSolutionPath():
        return None
    trajectory = to_trajectory(setup.getSolutionPath(), model, planner=spec.name, seed=seed)
    reached = model.goal_distance(trajectory.states[-1:])[0] < model.goal_threshold
    return trajectory if reached else None


def _fresh(model: ResettableModel) -> ResettableModel:
    """Return a new environment of the same kind; the same one when nobody can build another."""
    load_environments()
    return make(model.spec) if model.spec.id in gymnasium.registry else model


@contextmanager
def _new_folder(out: str | Path | None) -> Iterator[RunFolder | None]:
    """Open the result folder; when the run fails, take away what it has written."""
    if out is None:
        yield None
        return
    existed = Path(out).exists()
    with RunFolder(out) as folder:
        try:
            yield folder
            return
        except BaseException:
            for name in (TRAJECTORY, TREE, CONFIG, PROVENANCE, RESULT):
                (folder.path / name).unlink(missing_ok=True)
            folder.close()
            if not existed:
                folder.path.rmdir()
            raise


def _write(folder: RunFolder, result: PlanResult, model: ResettableModel, spec: PlannerSpec,
           limits: Limits) -> None:
    if result.trajectory is not None:
        result.trajectory.save(folder.path / TRAJECTORY)
    result.tree.save(folder.path / TREE)
    folder.write_config({
        "kind": "plan", "planner": spec.name, "seed": result.seed, **limits._asdict(),
        "environment": model.spec.to_dict(), "planner_kwargs": spec.options, "versions": planning_versions()})
    folder.write_result(result.summary())
