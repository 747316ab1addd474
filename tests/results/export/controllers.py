"""Controllers of every kind with random networks, and observations near which they switch."""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.envs.car_robot import CarRobot, wrapped
from pbcs_ompl.envs.point_robot import PointRobot
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.skills.activation_sets import Ball, EnvironmentGoal
from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.observed_sets import Entry, ObservedBall, ObservedClassifier
from pbcs_ompl.skills.path_following.chain import FollowChain
from pbcs_ompl.skills.path_following.follower import LineView
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.path_following.shown_feature import NO_SINE, ShownFeature
from pbcs_ompl.skills.policy import ObservationTransform, SkillPolicy
from pbcs_ompl.skills.robots.follower import LOST_AFTER, RobotFollower
from pbcs_ompl.skills.robots.places import periods
from pbcs_ompl.skills.robots.view import RobotView

MAZE = EnvSpec("pbcs/Maze-v0", {"size": 2})
HIDDEN = (64, 64)


class Case(NamedTuple):
    """A controller, and observations [T, B, O] of B episodes side by side."""

    controller: object
    observations: np.ndarray
    line: Line | None = None


def network(rng: np.random.Generator, size: int, low: float = -0.1, high: float = 0.1, normed: bool = False) -> Policy:
    widths, layers = (size, *HIDDEN, 2), []
    for index in range(len(widths) - 1):
        layer = [rng.normal(scale=widths[index] ** -0.5, size=widths[index:index + 2]),
                 rng.normal(size=widths[index + 1])]
        if normed and index < len(widths) - 2:
            layer += [rng.uniform(0.5, 1.5, widths[index + 1]), rng.normal(size=widths[index + 1])]
        layers.append(tuple(np.array(part, np.float32) for part in layer))
    return Policy(tuple(layers), np.full(2, low), np.full(2, high))


def classifier(rng: np.random.Generator, size: int) -> ObservedClassifier:
    return ObservedClassifier(0.6, rng.normal(size=size), np.full(size, 0.5), rng.normal(size=(size, 8)),
                              rng.normal(size=8), rng.normal(size=(8, 1)), rng.normal(size=1))


def chain(actions: ActionMap, normed: bool = False) -> Case:
    rng = np.random.default_rng(0)
    balls = [ObservedBall(rng.uniform(0, 2, 2), np.array([1.0, 0.5]), 0.5) for _ in range(5)]
    entries = [Entry(), Entry((balls[0],)), Entry((balls[1], classifier(rng, 2))), Entry((classifier(rng, 2),)),
               Entry((balls[2],)), Entry((balls[3], balls[4]))]
    skills = tuple(Skill(SkillPolicy(network(rng, 2, actions.low[0], actions.high[1], normed),
                                     ObservationTransform(rng.normal(size=2), rng.uniform(0.2, 2, 2))),
                         Ball(np.zeros(2), 0.1), EnvironmentGoal(0.1), entry) for entry in entries)
    walks = rng.uniform(0, 2, (1, 50, 2)) + np.cumsum(rng.normal(scale=0.1, size=(20, 50, 2)), axis=0)
    return Case(SkillChain(skills, np.zeros(2), MAZE, 200, actions, 0), walks)


def follow_chain() -> Case:
    rng = np.random.default_rng(1)
    line = Line.through(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]), 0.5, pass_radius=2.0)
    view = LineView(ShownFeature.plain(np.array([1, 0])), np.array([0.1, 0.1]),
                    ObservationTransform(np.ones(2), np.full(2, 2.0)), np.array([1.0, 2.0, 4.0]), 2.0, 10, lost_after=3)
    policies = tuple(network(rng, view.size) for _ in range(3))
    walks = np.cumsum(rng.uniform(-0.02, 0.1, (20, 50, 2)), axis=0)
    return Case(FollowChain(policies, (0, 8, 20), line, view, np.zeros(2), MAZE, 200,
                            ActionMap(np.full(2, -0.1, np.float32), np.full(2, 0.1, np.float32), (2,)), 0), walks)


def turning_chain() -> Case:
    """A follower of a place, of an angle that is an entry, and of one that is shown by its cosine and sine."""
    rng = np.random.default_rng(4)
    turn = 2.0 * np.pi
    line = Line.through(np.array([[0.0, 0.0, 0.0], [10.0, 60.0, -90.0], [30.0, 160.0, 0.0]]), 0.5, 2.0,
                        np.array([0.0, turn, turn]) / 0.1)
    view = LineView(ShownFeature(np.array([1, 0, 2]), np.array([NO_SINE, NO_SINE, 3])), np.full(3, 0.1),
                    ObservationTransform(np.ones(4), np.full(4, 2.0)), np.array([1.0, 2.0, 4.0]), 4.0, 10, lost_after=4)
    corners = line.points[::5][:, None] * 0.1 + rng.normal(scale=0.05, size=(len(line.points[::5]), 50, 3))
    x, one, other = np.moveaxis(corners[:20], 2, 0)
    walks = np.stack([np.mod(one + np.pi, turn) - np.pi, x, np.cos(other), np.sin(other)], axis=2)
    return Case(FollowChain((network(rng, view.size),), (0,), line, view, np.zeros(2), MAZE, 200, FLOAT64, 0), walks)


def point_follower() -> Case:
    rng = np.random.default_rng(2)
    view = RobotView(PointRobot(), ObservationTransform.identity(0), np.array([0.1, 0.2, 0.4]), 0.3, 15)
    line = Line.through(np.array([[0.0, 0.0], [1.0, 0.2], [1.0, 1.5]]), 0.05)
    walks = np.cumsum(rng.uniform(-0.02, 0.1, (200, 5, 2)), axis=0)
    walks[15:15 + LOST_AFTER + 10] = walks[3]  # so long that pointers go back
    follower = RobotFollower(network(rng, view.size), view, MAZE, ActionMap(np.full(2, -0.1), np.full(2, 0.1), (2,)),
                             0.05, 0.1, {})
    return Case(follower, walks, line)


def ant_follower() -> Case:
    rng = np.random.default_rng(3)
    follower = RobotFollower.shipped("ant")
    line = Line.through(np.array([[0.0, 0.0], [4.0, 0.5], [4.0, -6.0]]), follower.spacing)
    walks = rng.normal(size=(20, 50, 29))
    walks[:, :, :2] = np.cumsum(rng.uniform(-0.1, 0.4, (20, 50, 2)), axis=0)
    return Case(follower, walks, line)


def car_follower() -> Case:
    """Its heading counts on the line, which turns further than a whole turn."""
    rng = np.random.default_rng(5)
    robot = CarRobot(turning=0.9)
    view = RobotView(robot, ObservationTransform(rng.normal(size=4), rng.uniform(0.5, 2.0, 4)),
                     np.array([0.2, 0.6, 1.5]), 0.5, 3)
    line = Line.through(np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 4.0], [1.0, 1.5, 9.0]]), 0.05, periods=periods(robot))
    x, y, turned = np.moveaxis(line.points[::8][:20, None] + rng.normal(scale=0.1, size=(20, 50, 3)), 2, 0)
    heading, speed = wrapped(turned / robot.turning), rng.uniform(-1.0, 2.0, (20, 50))
    walks = np.stack([x, y, heading, speed, np.cos(heading), np.sin(heading)], axis=2)
    walks[10:] = walks[10]  # so long that it is stuck
    follower = RobotFollower(network(rng, view.size), view, MAZE, ActionMap(np.full(2, -0.1), np.full(2, 0.1), (2,)),
                             0.05, 0.2, {})
    return Case(follower, walks, line)


FLOAT64 = ActionMap(np.full(2, -0.1), np.full(2, 0.1), (2,))
CASES = {"chain": lambda: chain(FLOAT64), "chain of normalised layers": lambda: chain(FLOAT64, normed=True),
         "chain of integers": lambda: chain(ActionMap(np.array([-1, -2]), np.array([1, 3]), (2,))),
         "follow chain": follow_chain, "turning chain": turning_chain,
         "point follower": point_follower, "car": car_follower, "ant": ant_follower}


def actions_of(case: Case) -> np.ndarray:
    """What the toolkit's own controller does, [T, B, A]."""
    controller = (case.controller.controller(case.line) if isinstance(case.controller, RobotFollower)
                  else case.controller.controller())
    controller.reset(case.observations.shape[1])
    return np.array([controller.act(observations.copy()) for observations in case.observations])
