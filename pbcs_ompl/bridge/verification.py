"""Is a plan true? Its actions are executed in a fresh environment, and compared with what the planner believed."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import NotVerified, PbcsError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.resettable.adapt import second_model
from pbcs_ompl.resettable.adapters.vectorised import VectorisedModel
from pbcs_ompl.resettable.fresh import close
from pbcs_ompl.resettable.judge import Execution, Judge
from pbcs_ompl.resettable.model import Model


@dataclass(frozen=True)
class Verification:
    """What became of a plan in a fresh environment.

    Attributes:
        solved: Whether the environment granted the goal, along the states of the plan.
        replays: Whether the plan's states came back bit for bit; None where it could not be executed.
        reason: Why it is not solved; None when it is.
    """

    solved: bool
    replays: bool | None
    reason: str | None


def verify(trajectory: Trajectory, model: ResettableModel) -> Verification:
    """Execute a plan in a fresh environment.

    Args:
        trajectory: What a planner believes to end in the goal.
        model: Where it was found.
    """
    try:
        judge = Judge.of(model)
        if trajectory.reset_seed is None:
            raise NotVerified("not verified: the plan does not start where a reset does")
        execution = judge.execute(trajectory.actions, trajectory.reset_seed)
        different = None if _replays_at_once(trajectory, model, execution) else _first_difference(trajectory, model)
    except NotVerified as error:
        return Verification(False, None, str(error))
    except PbcsError as error:
        return Verification(False, False, f"the plan does not execute: {error}")
    if different is None and execution.success:
        return Verification(True, True, None)
    where = "" if different is None else f": differs from step {different} on"
    if different is None or not execution.success:
        where += f"{',' if where else ':'} {_ending(execution, trajectory, model)}"
    return Verification(False, different is None, f"the plan does not execute{where}")


def _ending(execution: Execution, trajectory: Trajectory, model: ResettableModel) -> str:
    if execution.ending == "end of the actions":
        return "the environment does not grant the goal at its end"
    if execution.ending == "truncated" and model.episode_limit == execution.steps:
        return (f"it has {trajectory.length} steps, and the environment ends an episode after {execution.steps} "
                f"(max_episode_steps lifts that)")
    return f"the environment ended the episode at step {execution.steps} of {trajectory.length} ({execution.ending})"


def _replays_at_once(trajectory: Trajectory, model: ResettableModel, execution: Execution) -> bool:
    """Return whether one batch of transitions, and what was seen in the execution, show the plan's states.

    Where transitions are functions of states, each of them leads to the next state of the plan, and the fresh
    environment has shown what it shows in just these states, the plan was replayed in it.
    """
    seen = execution.observations
    if not isinstance(model, VectorisedModel) or seen is None or len(seen) != len(trajectory.states):
        return False
    states = trajectory.states
    try:
        after = model.transition(states[:-1], trajectory.controls).states
    except Exception:  # of the environment; the replay step by step finds and names it
        return False
    return (model.initial_state(trajectory.reset_seed).tobytes() == states[0].tobytes()
            and after.tobytes() == states[1:].tobytes() and bool(np.array_equal(model.observe(states), seen)))


def _first_difference(trajectory: Trajectory, model: ResettableModel) -> int | None:
    """Return the first step that a second model replays otherwise; None if there is none.

    A model that no adapter has made cannot be made a second time: it replays the plan itself.
    """
    if not isinstance(model, Model) or model.make_env is None:
        return trajectory.first_difference(model)
    second = second_model(model)
    try:
        return trajectory.first_difference(second)
    finally:
        close(second.env)
