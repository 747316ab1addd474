"""How well a follower drives along a plan, or along the shortest way to the goal: executions by the judge."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, Mismatch, MissingDependency
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.judge import Judge
from pbcs_ompl.skills.evaluation import MOST_EPISODES, Evaluation
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.follower import RobotFollower, shipped_followers
from pbcs_ompl.skills.robots.places import places_of
from pbcs_ompl.skills.robots.worlds import free_space, robot_of

ONWARDS = 20
"""The most steps by which a plan is continued in the goal (ours)."""
EXTRA = 4
"""Patiences in the time limit of an execution, beside those for each near look-ahead of the line (ours)."""


@checked
def evaluate_follower(follower: RobotFollower,
                      env: str | EnvSpec | gymnasium.Env[Any, Any] | ResettableModel | None = None, *,
                      trajectory: Trajectory | None = None, env_kwargs: dict[str, Any] | None = None,
                      episodes: int = 100, epsilon: float = 0.0, seed: int = 0) -> Evaluation:
    """Let a follower drive along a line in fresh environments, from their own starts, without any training.

    Args:
        follower: Of the same robot.
        env: The environment; None for that of the trajectory.
        trajectory: A plan; None for the shortest way from a start to the goal, which needs walls and a `goal_circle`.
        env_kwargs: Options of the environment, when `env` is an id.
        episodes: Number of executions; their resets have seeds of their own.
        epsilon: Fraction of actions that are replaced by random ones.
        seed: Of the resets and the random actions.

    Raises:
        InvalidOption: neither environment nor trajectory, no episodes, or an epsilon outside [0, 1].
        Mismatch: the robot is another one, the trajectory belongs to another environment, or the goal is unknown.
        InvalidState: no way leads to the goal.
        NotVerified: no fresh environment can be made.
    """
    check_range("episodes", episodes, 1 <= episodes <= MOST_EPISODES, f"from 1 to {MOST_EPISODES}")
    check_range("epsilon", epsilon, 0 <= epsilon <= 1, "within [0, 1]")
    if env is None and trajectory is None:
        raise InvalidOption("env and trajectory are None; expected an environment, or a plan in one")
    model = make(trajectory.environment if env is None and trajectory is not None else env, env_kwargs)  # type: ignore[arg-type]
    check_robot(follower, model)
    if trajectory is not None:
        trajectory.check_belongs_to(model)
    line = shortest_line(follower, model) if trajectory is None else planned_line(follower, model, trajectory)
    return drive(follower, model, line, episodes=episodes, epsilon=epsilon, seed=seed)


def drive(follower: RobotFollower, model: ResettableModel, line: Line, *, episodes: int, epsilon: float = 0.0,
          seed: int = 0, entries: Sequence[int] | None = None) -> Evaluation:
    """Let a follower drive along a line; see `evaluate_follower`.

    Args:
        follower: Of the same robot.
        model: Its fresh environments are driven in.
        line: Where to go.
        episodes, epsilon, seed: See `evaluate_follower`.
        entries: Of the observation; see `RobotFollower.controller`.
    """
    near, patience = float(follower.view.distances.min()), follower.view.patience
    limit = min(model.max_episode_steps, int(patience * (line.length / near + EXTRA)))
    seeds = SeedTree(seed).child("resets")
    executions = Judge.of(model).drive(
        follower.controller(line, entries), reset_seeds=[seeds.child(str(k)).integer() for k in range(episodes)],
        max_steps=limit, epsilon=epsilon, seed=seed)
    return Evaluation.of(executions, epsilon)


def check_robot(follower: RobotFollower, model: ResettableModel) -> None:
    """Raise Mismatch where the robot of a model is none, or another one than a follower's."""
    robot_of(model)
    mine, theirs = follower.policy, model
    if (len(follower.view.normaliser.origin) + 2 != model.observation_size
            or not np.array_equal(mine.action_low, theirs.action_low)
            or not np.array_equal(mine.action_high, theirs.action_high)):
        raise Mismatch(f"the follower was trained for the robot of {follower.environment.label}, not for that of "
                       f"{model.spec.label}: observations or actions differ; train one for it, or take one of those "
                       f"that come with the package ({', '.join(shipped_followers())})")


def followers_of(model: ResettableModel) -> list[str]:
    """Return the names of the followers that come with the package and were trained for the robot of a model."""
    found = []
    for name, folder in shipped_followers().items():
        with suppress(Mismatch, MissingDependency):
            check_robot(RobotFollower.load(folder), model)
            found.append(name)
    return found


def planned_line(follower: RobotFollower, model: ResettableModel, trajectory: Trajectory) -> Line:
    """Return the line along a plan, and on into the goal.

    Where lines are of places alone it ends at the centre of the goal, if that is known; else in the middle of the
    states in the goal to which the plan's last action leads, since a plan ends as soon as it is there.
    """
    robot = follower.view.robot
    places = places_of(robot, model.observe(trajectory.states))
    if robot.turning > 0.0:
        onwards = places_of(robot, model.observe(_onwards(model, trajectory)))
    else:
        onwards = np.empty((0, 2)) if model.goal_circle is None else np.array([model.goal_circle[:2]])
    return follower.line_of(np.concatenate([places, onwards]))


def _onwards(model: ResettableModel, trajectory: Trajectory) -> Array:
    """Return states [N, D] to which the last action of a plan leads: the first half of those in the goal."""
    state, control = trajectory.states[-1:], trajectory.controls[-1:]
    found: list[Array] = []
    while len(found) < ONWARDS:
        step = model.transition(state, control)
        if not step.success[0] or np.array_equal(step.states, state):
            break
        state = step.states
        found.append(state)
    half = found[:(len(found) + 1) // 2]
    return np.concatenate(half) if half else np.empty((0, len(model.state_low)))


def smoothed_line(follower: RobotFollower, model: ResettableModel, trajectory: Trajectory) -> Line:
    """Return a line near a plan that keeps clear of walls, to the centre of the goal.

    Where the environment does not say where its goal is, it ends where the plan does. A robot whose heading counts
    could not follow ways that were made without it: its line is that of the plan.

    Raises:
        InvalidState: no way leads there.
    """
    robot = follower.view.robot
    if robot.turning > 0.0:
        return planned_line(follower, model, trajectory)
    places = places_of(robot, model.observe(trajectory.states))
    goal = places[-1] if model.goal_circle is None else np.array(model.goal_circle[:2])
    return free_space(model, follower.clearance).smoothed(places, goal, follower.spacing)


def shortest_line(follower: RobotFollower, model: ResettableModel) -> Line:
    """Return the line of the shortest way from a start to the goal that keeps clear of walls.

    Raises:
        Mismatch: the environment has no `goal_circle`, or the heading of its robot counts.
        InvalidState: no way leads to the goal.
    """
    if follower.view.robot.turning > 0.0:
        raise Mismatch(f"the robot of {model.spec.id} cannot turn on the spot: what it follows is a plan; give one "
                       "(--path PLAN), or plan and follow in one, pbcs plan --follow FOLLOWER")
    if model.goal_circle is None:
        raise Mismatch(f"{model.spec.id} does not say where its goal is (goal_circle); give a plan")
    start = follower.view.places(model.observe(model.initial_state(0)[None]))[0]
    return free_space(model, follower.clearance).line_between(start, np.array(model.goal_circle[:2]), follower.spacing)
