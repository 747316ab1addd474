"""The followers that come with the package drive in mazes that they never saw, without training there."""

import json

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import UnknownName
from pbcs_ompl.skills import RobotFollower, evaluate_follower
from pbcs_ompl.skills.robots.evaluation import followers_of
from pbcs_ompl.skills.robots.follower import shipped_followers
from pbcs_ompl.skills.robots.shaking import CYCLE, waves

ANTS = [name for name in shipped_followers() if name.startswith("ant")]


@pytest.fixture(scope="module")
def ant() -> RobotFollower:
    pytest.importorskip("mujoco")
    return RobotFollower.shipped("ant")


@pytest.mark.parametrize(("name", "options"), [
    ("ant", {}), ("ant", {"size": 4, "maze_seed": 503}), ("ant", {"map": "umaze", "goal_radius": 0.45}),
    ("ant-d4rl", {"ant": "d4rl"})])
def test_the_ant_walks_to_the_goal(name: str, options: dict) -> None:
    pytest.importorskip("mujoco")
    found = evaluate_follower(RobotFollower.shipped(name), "pbcs/AntMaze-v0", env_kwargs={**options, "threads": 1},
                              episodes=4)
    assert found.successes >= 3, found


def test_an_ant_on_its_back_gets_up(ant: RobotFollower) -> None:
    """It shakes as long as it has fallen; then its policy acts again."""
    model, count = pbcs_ompl.make("pbcs/AntMaze-v0", {"integrator": "Euler", "threads": 1}), 8
    states = np.array([model.initial_state(seed) for seed in range(count)])
    states[:, 3], states[:, 4:8] = 0.4, [0.0, 1.0, 0.0, 0.0]
    controller, up = ant.controller(ant.line_of(np.array([[2.0, 2.0], [2.0, 6.0]]))), np.zeros(count, bool)
    controller.reset(count)
    for step in range(400):
        fallen = ant.view.robot.fallen(model.observe(states))
        assert step > 0 or fallen.all()
        controls = controller.act(model.observe(states))
        swung = np.abs(controls[fallen]) == 1.0
        assert swung.all()
        states, up = model.transition(states, controls).states, up | ~fallen
        if up.sum() >= 6:
            return
    pytest.fail(f"{up.sum()} of {count} got up")


def test_no_two_joints_swing_together_for_long() -> None:
    controls = waves(np.full(8, -1.0), np.full(8, 1.0))
    together = controls.T @ controls / CYCLE
    assert np.abs(together[~np.eye(8, dtype=bool)]).max() < 0.3
    np.testing.assert_array_equal(np.abs(controls), 1.0)


@pytest.mark.parametrize("name", ANTS)
def test_its_training_is_recorded_and_none_of_its_worlds_is_in_the_tables(name: str) -> None:
    pytest.importorskip("mujoco")
    training = RobotFollower.shipped(name).training
    assert training["transitions"] > 500_000
    assert training["settings"]["patience"] == 30
    assert {world.get("maze_seed", 0) for world in training["worlds"]} <= {0, *range(100, 112)}
    assert training["versions"]["mujoco"]


def test_the_quadrotor_flies_a_plan_past_walls_that_it_never_saw(monkeypatch: pytest.MonkeyPatch) -> None:
    obstacles = [[2.0, 0.0, 2.3, 3.2], [3.8, 2.6, 4.1, 6.0]]
    model = pbcs_ompl.make("pbcs/PlanarQuadrotor-v0", {"obstacles": obstacles, "start": [1.0, 1.5, 0.0]})
    follower = RobotFollower.shipped("quadrotor")
    for episodes, epsilon, least in ((1, 0.0, 1), (20, 0.1, 16)):
        found = evaluate_follower(follower, model, episodes=episodes, epsilon=epsilon, seed=1)
        assert found.successes >= least, found
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)  # its own robot is found without MuJoCo
    assert followers_of(model) == ["quadrotor"]


def test_the_car_parks_along_plans_past_walls_that_it_never_saw() -> None:
    """Both plans come from the planner that makes shorter ones; see docs/benchmarks.md for how often it parks."""
    follower, options = RobotFollower.shipped("car"), {"obstacles": [[2.5, 0.0, 2.8, 4.5], [5.0, 3.5, 5.3, 8.0]]}
    for goal in ((6.5, 6.0, 1.5), (1.2, 6.5, -2.0)):
        model = pbcs_ompl.make("pbcs/CarPark-v0", options | {"start": [1.0, 1.5, 0.5], "goal": list(goal)})
        trajectory = pbcs_ompl.plan(model, "RidesSST", improve="100%", seed=0).trajectory
        assert trajectory is not None
        found = evaluate_follower(follower, trajectory=trajectory, episodes=20, epsilon=0.1, seed=1)
        assert found.successes >= 12, found
    assert followers_of(model) == ["car"]


def test_the_command_line_knows_it_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    words = ["eval", "ant", "--env", "pbcs/AntMaze-v0", "--episodes", "2", "--json"]
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["episodes"] == 2


def test_unknown_names_and_other_robots_are_refused(ant: RobotFollower) -> None:
    with pytest.raises(UnknownName, match="'ant'"):
        RobotFollower.shipped("aunt")
    with pytest.raises(pbcs_ompl.core.errors.Mismatch, match=r"observations or actions differ.*ant-d4rl"):
        evaluate_follower(ant, "pbcs/AntMaze-v0", env_kwargs={"ant": "d4rl"})


def test_an_environment_is_offered_the_follower_of_its_robot() -> None:
    assert followers_of(pbcs_ompl.make("pbcs/AntMaze-v0", {"size": 3, "integrator": "Euler"})) == ["ant"]
    assert followers_of(pbcs_ompl.make("pbcs/AntMaze-v0", {"ant": "d4rl"})) == ["ant-d4rl"]
    assert followers_of(pbcs_ompl.make("pbcs/Maze-v0")) == []
