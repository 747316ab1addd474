"""The car and the planar quadrotor: kernel and FCL agree, steps of all forms are equal, the physics is what it says."""

import gymnasium
import numpy as np
import pytest

import envs  # noqa: F401 - registers
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.envs.oriented_kernels import touching
from pbcs_ompl.envs.walls_fcl import WallsFcl

IDS = ["pbcs/CarPark-v0", "pbcs/PlanarQuadrotor-v0"]


def make(env_id: str, **kwargs: object) -> gymnasium.Env:
    return gymnasium.make(env_id, **kwargs).unwrapped  # type: ignore[arg-type]


def some_states(env: gymnasium.Env, count: int, seed: int = 0) -> np.ndarray:
    """Return random valid states, of which many end at walls and in the goal."""
    rng = np.random.default_rng(seed)
    states = rng.uniform(env.state_low, env.state_high, (4 * count, len(env.state_low)))
    states[::5, :2] = np.array(env.goal_circle[:2]) + rng.uniform(-0.5, 0.5, (len(states[::5]), 2))
    return states[env.is_valid(states)][:count]


@pytest.mark.parametrize("env_id", IDS)
def test_all_forms_of_the_step_are_bit_equal(env_id: str) -> None:
    env = make(env_id)
    states = some_states(env, 500)
    controls = np.random.default_rng(1).uniform(-1.5, 1.5, (len(states), 2))
    batch = env.transition(states, controls)
    step, settings, table, integers = env.compiled_step()
    rows, given = np.concatenate([states, np.zeros_like(states)]), np.concatenate([controls, controls])
    for k, state in enumerate(states):
        outcome = step(settings, table, integers, rows, k, given, len(states) + k)
        assert outcome == (batch.rewards[k], batch.terminated[k], batch.success[k])
        env.set_env_state(state)
        observation, reward, terminated, truncated, info = env.step(controls[k])
        np.testing.assert_array_equal(env.get_env_state(), batch.states[k])
        np.testing.assert_array_equal(observation, env.observe(batch.states[k:k + 1])[0])
        assert (reward, terminated, truncated) == (batch.rewards[k], batch.terminated[k], False)
        assert info["success"] == batch.success[k] == (info["distance_to_goal"] < env.goal_threshold)
    np.testing.assert_array_equal(rows[len(states):], batch.states)
    assert 0 < batch.success.sum() < len(states)


@pytest.mark.parametrize("env_id", IDS)
def test_bodies_stay_where_they_can_be(env_id: str) -> None:
    env = make(env_id)
    states, rng = some_states(env, 200), np.random.default_rng(2)
    for _ in range(60):
        states = env.transition(states, rng.uniform(-1.0, 1.0, (len(states), 2))).states
        assert env.is_valid(states).all()


def test_the_kernel_and_fcl_agree_on_rectangles() -> None:
    rng = np.random.default_rng(3)
    corners = rng.uniform(1.0, 7.0, (12, 2))
    walls = np.concatenate([corners, corners + rng.uniform(0.05, 2.0, corners.shape)], axis=1)
    poses = rng.uniform([1.0, 1.0, -np.pi], [7.0, 7.0, np.pi], (3000, 3))
    fcl, half = WallsFcl(walls), (0.5, 0.2)
    found, expected = touching(walls, 9.0, poses, *half), fcl.overlaps(poses, half)
    assert not (expected & ~found).any()  # what FCL calls a hit, the kernel does
    assert not (found & ~fcl.overlaps(poses, (half[0] + 1e-4, half[1] + 1e-4))).any()
    assert 500 < expected.sum() < 2500


def test_the_border_is_a_wall() -> None:
    half, none = (0.5, 0.25), np.empty((0, 4))
    poses = np.array([[0.51, 1.0, 0.0], [0.49, 1.0, 0.0], [0.26, 1.0, np.pi / 2], [0.24, 1.0, np.pi / 2],
                      [2.0, 3.74, 0.0], [2.0, 3.76, 0.0]])
    assert touching(none, 4.0, poses, *half).tolist() == [False, True, False, True, False, True]


@pytest.mark.parametrize("env_id", IDS)
def test_angles_are_periodic(env_id: str) -> None:
    env = make(env_id)
    states, rng = some_states(env, 200), np.random.default_rng(4)
    for _ in range(20):
        states = env.transition(states, rng.uniform(-1.0, 1.0, (len(states), 2))).states
        assert (np.abs(states[:, 2]) <= np.pi).all()
    one, other = states[:1].copy(), states[:1].copy()
    one[0, 2], other[0, 2] = np.pi - 0.01, -np.pi + 0.01
    assert env.distance(one, other)[0] == pytest.approx(0.02)


def test_the_car_turns_on_the_circle_of_its_steering_angle() -> None:
    env = make("pbcs/CarPark-v0", obstacles=[], start=[4.0, 2.0, 0.0], goal=[7.0, 7.0, 0.0])
    state, radius = np.array([[4.0, 2.0, 0.0, 0.5]]), 0.6 / np.tan(0.3)
    for _ in range(100):
        state = env.transition(state, np.array([[0.0, 0.5]])).states
        assert np.hypot(state[0, 0] - 4.0, state[0, 1] - 2.0 - radius) == pytest.approx(radius, abs=0.02)
    assert state[0, 3] == 0.5


def test_a_car_that_hits_a_wall_stands_still_and_can_drive_back() -> None:
    env = make("pbcs/CarPark-v0")
    state = np.array([[4.0, 2.2, np.pi / 2, 2.0]])
    for _ in range(6):
        outcome = env.transition(state, np.array([[1.0, 0.0]]))
        state = outcome.states
    assert state[0, 3] == 0.0
    assert not outcome.terminated[0]
    assert env.transition(state, np.array([[-1.0, 0.0]])).states[0, 1] < state[0, 1]


def test_a_parked_car_needs_the_place_and_the_heading() -> None:
    env = make("pbcs/CarPark-v0")
    states = np.array([[4.0, 6.9, np.pi / 2, 0.0], [4.0, 6.9, 0.0, 0.0], [4.0, 6.5, np.pi / 2, 0.0],
                       [4.2, 6.8, np.pi / 2 + 0.25, 1.0]])
    assert (env.goal_distance(states) < env.goal_threshold).tolist() == [True, False, False, True]


def test_the_quadrotor_hovers_climbs_and_tilts() -> None:
    env = make("pbcs/PlanarQuadrotor-v0")
    state, _ = env.reset()
    state = env.get_env_state()[None]
    np.testing.assert_allclose(env.transition(state, np.zeros((1, 2))).states, state, atol=1e-12)
    assert env.transition(state, np.ones((1, 2))).states[0, 4] > 0.0  # climbs
    tilted = env.transition(state, np.array([[-0.5, 0.5]])).states
    assert tilted[0, 2] > 0.0  # the right rotor pushes harder: counter-clockwise
    assert env.transition(tilted, np.zeros((1, 2))).states[0, 3] < 0.0  # and so to the left


def test_without_lift_it_falls_until_it_crashes() -> None:
    env = make("pbcs/PlanarQuadrotor-v0", start=[1.0, 3.0, 0.0])
    env.reset()
    steps, terminated, info = 0, False, {"success": False}
    while not terminated:
        *_, terminated, _, info = env.step(np.array([-1.0, -1.0]))
        steps += 1
    pull, drag, fastest, height = 0.9 * 9.81, 0.5, 4.0, 3.0 - 0.06
    until_fastest = -np.log(1.0 - fastest * drag / pull) / drag
    by_then = pull / drag * until_fastest - fastest / drag
    assert 0.05 * steps == pytest.approx(until_fastest + (height - by_then) / fastest, abs=0.1)
    assert not info["success"]
    assert env.is_valid(env.get_env_state()[None])[0]


@pytest.mark.parametrize("env_id", IDS)
def test_pictures_show_the_body_the_goal_and_the_walls(env_id: str) -> None:
    env = make(env_id, render_mode="rgb_array")
    env.reset()
    picture, scale = env.render(), 480 / env.state_high[0]
    x, y, _ = env.poses(env.get_env_state()[None])[0]
    assert tuple(picture[479 - int(y * scale), int(x * scale)]) == (205, 50, 50)
    for colour, area in (((40, 40, 46), np.prod(env.obstacles[:, 2:] - env.obstacles[:, :2], axis=1).sum()),
                         ((120, 200, 120), np.pi * env.goal_circle[2] ** 2)):
        assert (picture == colour).all(axis=2).sum() == pytest.approx(area * scale**2, rel=0.1)
    boxes = np.isin(picture[..., 0], (205, 110)) & (picture[..., 1] < 60)
    assert boxes.sum() == pytest.approx(4 * np.prod(env.half_edges) * scale**2, rel=0.1)


@pytest.mark.parametrize(("env_id", "options", "error", "complaint"), [
    ("pbcs/CarPark-v0", {"start": [4.0, 3.7, 0.0]}, InvalidState, "touches a wall"),
    ("pbcs/CarPark-v0", {"start": [4.0, 3.7]}, InvalidOption, "poses"),
    ("pbcs/CarPark-v0", {"goal": [4.0, 3.7, 0.0]}, InvalidState, "goal"),
    ("pbcs/CarPark-v0", {"obstacles": [[1.0, 1.0, 0.5, 2.0]]}, InvalidOption, "x0 < x1"),
    ("pbcs/CarPark-v0", {"obstacles": [[1.0, 1.0, 2.0]]}, InvalidOption, "rectangles"),
    ("pbcs/PlanarQuadrotor-v0", {"goal": [9.0, 1.0]}, InvalidState, "outside"),
    ("pbcs/PlanarQuadrotor-v0", {"goal": [1.0]}, InvalidOption, "place"),
    ("pbcs/PlanarQuadrotor-v0", {"obstacles": [[1.0, 1.0, 2.0, 7.0]]}, InvalidOption, "within"),
])
def test_impossible_options(env_id: str, options: dict[str, object], error: type[Exception], complaint: str) -> None:
    with pytest.raises(error, match=complaint):
        make(env_id, **options).reset()


@pytest.mark.parametrize("env_id", IDS)
def test_walls_have_the_border_and_steps_do_not(env_id: str) -> None:
    env = make(env_id)
    extent = env.state_high[0]
    _, _, obstacles, _ = env.compiled_step()
    np.testing.assert_array_equal(env.walls[:-4], obstacles)
    border = env.walls[-4:]
    assert ((border[:, 2:] <= 0.0) | (border[:, :2] >= extent)).any(axis=1).all()  # outside, each on one side
    assert np.prod(border[:, 2:] - border[:, :2], axis=1).sum() == pytest.approx((extent + 0.2) ** 2 - extent ** 2)


@pytest.mark.parametrize("angle", [0.3, -2.0, np.pi])
def test_a_turned_car_moves_in_the_turned_direction(angle: float) -> None:
    env = make("pbcs/CarPark-v0", obstacles=[], start=(4.0, 4.0, 0.0))
    rng, count = np.random.default_rng(4), 50
    states = np.column_stack([rng.uniform(3.0, 5.0, (count, 2)), rng.uniform(-np.pi, np.pi, count),
                              rng.uniform(-1.0, 2.0, count)])
    controls, angles = rng.uniform(-1.0, 1.0, (count, 2)), np.full(count, angle)
    after = env.observe(env.transition(states, controls).states)
    turned = env.observe(env.transition(env.robot.put(states, states[:, :2], angles), controls).states)
    moved = env.robot.turned(after - np.pad(states[:, :2], ((0, 0), (0, 4))), angles)
    np.testing.assert_allclose(turned[:, :2], moved[:, :2] + states[:, :2], atol=1e-12)
    np.testing.assert_allclose(turned[:, 3:], moved[:, 3:], atol=1e-12)
    np.testing.assert_allclose(np.cos(env.robot.heading(turned)), turned[:, 4], atol=1e-12)
