"""The ant: its symmetries, its two kinds, when it has fallen, and the maps it walks in."""

from typing import Any

import numpy as np
import pytest

from pbcs_ompl.core.rendering import prefer_headless_rendering

prefer_headless_rendering()
mujoco = pytest.importorskip("mujoco")

from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.envs.ant_maze import AntMazeEnv, healthy
from pbcs_ompl.envs.maze_maps import MAPS, MazeMap


def moving(env: AntMazeEnv, count: int = 8, steps: int = 25) -> np.ndarray:
    """States [B, D] of ants that stumble in the middle of an open square, far from its walls."""
    rng = np.random.default_rng(0)
    states = []
    for seed in range(count):
        env.reset(seed=seed)
        states.append(env.get_env_state())
    batch = env.robot.put(np.array(states), np.full((count, 2), 12.0), rng.uniform(-np.pi, np.pi, count))
    for _ in range(steps):
        batch = env.transition(batch, rng.uniform(-1, 1, (count, 8)) * env.action_space.high).states
    return batch


@pytest.mark.parametrize("ant", ["gymnasium", "d4rl"])
@pytest.mark.parametrize("integrator", ["RK4", "Euler"])
@pytest.mark.parametrize("index", range(4))
def test_an_ant_seen_from_another_leg_moves_as_the_same_ant(index: int, ant: str, integrator: str) -> None:
    env = AntMazeEnv(6, map="open", ant=ant, integrator=integrator, threads=1)
    states, symmetry = moving(env), env.robot.symmetries[index]
    controls = np.random.default_rng(1).uniform(-1, 1, (len(states), 8)) * env.action_space.high
    seen = states.copy()
    seen[:, 1:] = states[:, 1:] @ symmetry.observation.T
    after = env.observe(env.transition(states, controls).states)
    alike = env.observe(env.transition(seen, controls @ symmetry.action.T).states)
    assert np.abs(after - env.observe(states)).max() > 0.1
    np.testing.assert_allclose(after @ symmetry.observation.T, alike, atol=1e-12, rtol=1e-12)
    turned = np.angle(np.exp(1j * (env.robot.heading(env.observe(seen)) - env.robot.heading(env.observe(states)))))
    upright = 1 - 2 * (states[:, 5] ** 2 + states[:, 6] ** 2) > 0.9
    expected = np.angle(np.exp(1j * index * np.pi / 2))
    assert upright.any()
    assert np.abs(np.angle(np.exp(1j * (turned[upright] - expected)))).max() < 0.2


@pytest.mark.parametrize("angle", [0.3, -2.0, np.pi])
def test_a_turned_ant_moves_in_the_turned_direction(angle: float) -> None:
    env = AntMazeEnv(6, map="open", threads=1)
    states = moving(env)
    controls = np.random.default_rng(1).uniform(-1, 1, (len(states), 8))
    angles, places = np.full(len(states), angle), states[:, 1:3]
    turned = env.transition(env.robot.put(states, places, angles), controls).states
    after = env.transition(states, controls).states
    mine, theirs = env.robot.turned(env.observe(after), angles), env.robot.turned(env.observe(turned), 0 * angles)
    np.testing.assert_allclose(theirs[:, 2:], mine[:, 2:], atol=1e-12, rtol=1e-12)
    moved = env.robot.turned(env.observe(after) - np.pad(places, ((0, 0), (0, 27))), angles)[:, :2]
    np.testing.assert_allclose(turned[:, 1:3] - places, moved, atol=1e-12)
    np.testing.assert_allclose(env.robot.heading(mine) - env.robot.heading(theirs), 0.0, atol=1e-12)


def test_the_ant_of_d4rl_is_weaker_and_slower() -> None:
    ours, theirs = AntMazeEnv(), AntMazeEnv(ant="d4rl")
    assert (ours.step_seconds, theirs.step_seconds) == (pytest.approx(0.05), pytest.approx(0.1))
    torques = [env.action_space.high * env.model.actuator_gear[:, 0] for env in (ours, theirs)]
    np.testing.assert_array_equal(torques[0], np.full(8, 150.0))
    np.testing.assert_array_equal(torques[1], np.full(8, 30.0))


def test_a_fallen_ant_ends_the_episode_only_where_that_is_asked_for() -> None:
    env, kind = AntMazeEnv(reset_noise=0.0, terminate_when_unhealthy=True), AntMazeEnv(reset_noise=0.0)
    env.reset(seed=0)
    standing = env.get_env_state()
    states = np.tile(standing, (5, 1))
    states[1, 3], states[2, 3] = 0.05, 1.6
    states[3, 4:8] = [0.0, 1.0, 0.0, 0.0]  # on its back
    states[4, 4:8] = [np.cos(0.5), np.sin(0.5), 0.0, 0.0]  # leaning by one radian
    np.testing.assert_array_equal(healthy(states), [True, False, False, False, True])
    for size in (1.0, 1.3):  # resets give no unit quaternions
        states[:, 4:8] *= size
        np.testing.assert_array_equal(env.robot.fallen(env.observe(states)), [False, False, False, True, False])
    states[:, 4:8] /= 1.3
    broken = states.copy()
    broken[0, 20] = np.nan
    assert not healthy(broken)[0]
    assert env.transition(states[[2, 3]], np.zeros((2, 8))).terminated.all()
    assert not kind.transition(states[[2, 3]], np.zeros((2, 8))).terminated.any()
    assert not env.transition(states[:1], np.zeros((1, 8))).terminated.any()


def test_an_unhealthy_ant_ends_the_episode_of_step_as_well() -> None:
    env = AntMazeEnv(terminate_when_unhealthy=True)
    env.reset(seed=0)
    state = env.get_env_state()
    state[3] = 3.0
    env.reset(options={"state": state})
    _, reward, terminated, truncated, info = env.step(np.zeros(8))
    assert (reward, terminated, truncated, info["is_success"]) == (0.0, True, False, False)


def test_the_goal_radius_is_that_of_the_option() -> None:
    assert AntMazeEnv().goal_threshold == pytest.approx(0.8)
    env = AntMazeEnv(goal_radius=0.45)
    env.reset(seed=0)
    state = np.tile(env.get_env_state(), (2, 1))
    state[:, 1:3] = env.goal + np.array([[0.6, 0.0], [0.3, 0.0]])
    np.testing.assert_array_equal(env.transition(state, np.zeros((2, 8))).success, [False, True])


@pytest.mark.parametrize("name", MAPS)
def test_the_maps_are_those_of_gymnasium_robotics(name: str) -> None:
    maps = pytest.importorskip("gymnasium_robotics.envs.maze.maps")
    theirs = np.array(getattr(maps, {"umaze": "U_MAZE", "medium": "MEDIUM_MAZE", "large": "LARGE_MAZE"}[name]))
    drawn = np.array([[int(mark == "#") for mark in row] for row in MAPS[name]])
    np.testing.assert_array_equal(drawn, theirs)
    layout, height = MazeMap.named(name), len(theirs)
    for row, column in np.ndindex(theirs.shape):
        x, y = column + 0.5, height - row - 0.5
        x0, y0, x1, y1 = layout.walls.T
        assert bool(((x0 < x) & (x < x1) & (y0 < y) & (y < y1)).any()) == bool(theirs[row, column])


@pytest.mark.parametrize("name", [*MAPS, "open"])
def test_ants_start_in_free_space_and_the_goal_is_free(name: str) -> None:
    env = AntMazeEnv(4, map=name, goal_radius=0.45)
    _, info = env.reset(seed=0)
    state = env.get_env_state()[None]
    assert env.is_valid(state)[0]
    assert not info["is_success"]
    state[:, 1:3] = env.goal
    assert env.is_valid(state)[0]
    assert env.transition(state, np.zeros((1, 8))).success[0]


@pytest.mark.parametrize(("kwargs", "error"), [
    ({"ant": "gymnasum"}, UnknownName), ({"map": "u"}, UnknownName), ({"integrator": "implicit"}, UnknownName),
    ({"goal_radius": 0.0}, InvalidOption), ({"goal_radius": float("nan")}, InvalidOption),
    ({"map": "open", "size": 1}, InvalidOption)])
def test_bad_options(kwargs: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        AntMazeEnv(**kwargs)
