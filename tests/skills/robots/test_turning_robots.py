"""Robots whose heading counts on lines: a car's lines, where they come from, and how they end."""

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.core.errors import InvalidState, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.skills import evaluate_follower, train_follower
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.branches import random_branches
from pbcs_ompl.skills.robots.evaluation import planned_line, shortest_line, smoothed_line
from pbcs_ompl.skills.robots.follower import RobotFollower
from pbcs_ompl.skills.robots.lines import Lines
from pbcs_ompl.skills.robots.places import line_through, periods, places_of
from pbcs_ompl.skills.robots.shaking import BURST
from pbcs_ompl.skills.robots.worlds import robot_of

SMALL = {"lines_per_world": 6, "tests_per_world": 2, "longest": 5.0, "clearance": 0.2, "near": 0.2, "middle": 0.6,
         "far": 1.5, "window": 0.5, "goal_radius": 0.2, "stumbles": 10}


@pytest.fixture(scope="module")
def car() -> ResettableModel:
    return pbcs_ompl.make("pbcs/CarPark-v0")


@pytest.fixture(scope="module")
def follower() -> RobotFollower:
    return train_follower("pbcs/CarPark-v0", settings=SMALL, agent_settings={"hidden": [16, 16]},
                          max_transitions=10_000).follower


def test_turned_lines_side_by_side_are_the_lines_one_by_one(car: ResettableModel) -> None:
    """The headings of lines count on after whole turns; those of robots do not."""
    rng, turns = np.random.default_rng(0), periods(robot_of(car))
    assert turns is not None
    lines = [Line.through(np.cumsum(rng.normal(scale=[1, 1, 3], size=(count, 3)), axis=0), 0.05, periods=turns)
             for count in (3, 8, 20)]
    stack, rows = Lines.of(lines), rng.integers(0, 3, 300)
    pointers = np.array([rng.integers(0, lines[row].last + 1) for row in rows])
    features = stack[rows].at(pointers) + rng.normal(scale=0.3, size=(300, 3))
    features[:, 2] = (features[:, 2] + turns[2] / 2) % turns[2] - turns[2] / 2
    distances = np.array([0.1, 0.5, 2.0])
    advanced, ahead = stack[rows].advance(features, pointers, 1.0), stack[rows].ahead(features, pointers, distances)
    assert np.abs(features[:, 2] - stack[rows].at(pointers)[:, 2]).max() > turns[2]
    for k, row in enumerate(rows):
        one = lines[row]
        np.testing.assert_array_equal(advanced[k:k + 1], one.advance(features[k:k + 1], pointers[k:k + 1], 1.0))
        np.testing.assert_allclose(ahead[k:k + 1], one.ahead(features[k:k + 1], pointers[k:k + 1], distances))


def test_branches_begin_at_the_start_are_driven_by_the_car_and_repeat(car: ResettableModel) -> None:
    robot = robot_of(car)
    lines, again = (random_branches(car, robot, 8, np.random.default_rng(3), longest=6.0, spacing=0.05)
                    for _ in range(2))
    start = places_of(robot, car.observe(car.initial_state(0)[None]))[0]
    for line, same in zip(lines, again, strict=True):
        np.testing.assert_array_equal(line.points, same.points)
        np.testing.assert_allclose(line.points[0], start)
        assert 1.2 < line.length <= 6.0
        hops = np.diff(line.points, axis=0)
        along = np.cos(line.points[:-1, 2] / robot.turning) * hops[:, 0] + np.sin(
            line.points[:-1, 2] / robot.turning) * hops[:, 1]
        moved = np.hypot(hops[:, 0], hops[:, 1])
        assert np.median(np.abs(along)[moved > 0.01] / moved[moved > 0.01]) > 0.95  # forwards or backwards, not aside
    assert len({line.points[-1].tobytes() for line in lines}) > 4
    with pytest.raises(InvalidState, match="choose shorter ones"):
        random_branches(car, robot, 2, np.random.default_rng(0), longest=1000.0, spacing=0.05)


def test_the_line_of_a_plan_continues_in_the_goal(car: ResettableModel, follower: RobotFollower) -> None:
    """A plan ends where it enters the goal, so that what follows it less exactly would miss it."""
    trajectory = pbcs_ompl.plan(car, seed=0).trajectory
    assert trajectory is not None
    line, robot = planned_line(follower, car, trajectory), follower.view.robot
    alone = line_through(robot, places_of(robot, car.observe(trajectory.states)), follower.spacing)
    np.testing.assert_allclose(line.points[0], alone.points[0])
    end = np.array([[*line.points[-1, :2], line.points[-1, 2] / robot.turning, 0.0]])
    assert car.env.unwrapped.goal_distance(end)[0] < 1.0
    assert line.length > alone.length
    np.testing.assert_array_equal(smoothed_line(follower, car, trajectory).points, line.points)


def test_a_car_is_followed_along_plans_only(car: ResettableModel, follower: RobotFollower) -> None:
    with pytest.raises(Mismatch, match=r"cannot turn on the spot.*--path PLAN"):
        shortest_line(follower, car)
    with pytest.raises(Mismatch, match="cannot turn on the spot"):
        evaluate_follower(follower, "pbcs/CarPark-v0")
    trajectory = pbcs_ompl.plan(car, seed=0).trajectory
    assert evaluate_follower(follower, trajectory=trajectory, episodes=2).episodes == 2


def test_a_car_that_is_stuck_swings_and_drives_in_turns(car: ResettableModel, follower: RobotFollower) -> None:
    """It does so after as many steps without progress as training allows; robots that can turn anywhere do not."""
    trajectory = pbcs_ompl.plan(car, seed=0).trajectory
    assert trajectory is not None
    controller, patience = follower.controller(planned_line(follower, car, trajectory)), follower.view.patience
    observation = car.observe(car.initial_state(0)[None])[0]
    swung = []
    for _ in range(patience + 4 * BURST):
        control = controller.act(observation)
        swung.append(bool((np.abs(control) == 1.0).all()))
    expected = [*[False] * patience, *[True] * BURST, *[False] * BURST, *[True] * BURST, *[False] * BURST]
    assert swung == expected
