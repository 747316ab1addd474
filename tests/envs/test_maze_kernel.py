"""The compiled step against exact rational arithmetic, against all walls, and against itself one by one."""

from fractions import Fraction

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import envs  # noqa: F401 - registers
from pbcs_ompl.envs.maze import kernels
from pbcs_ompl.envs.maze.maze import MazeEnv

# Coordinates on a coarse lattice, so that segments often touch corners and edges exactly.
lattice = st.integers(-8, 8).map(lambda n: n / 8)
coordinate = lattice | st.floats(-1, 1, allow_subnormal=False)
RECTANGLE = (-0.5, -0.25, 0.5, 0.25)


def touches_exactly(x0: float, y0: float, x1: float, y1: float, rectangle: tuple[float, ...]) -> bool:
    """Clip the segment to the closed rectangle in rational arithmetic (Liang and Barsky)."""
    start, end = (Fraction(x0), Fraction(y0)), (Fraction(x1), Fraction(y1))
    first, last = Fraction(0), Fraction(1)
    for axis in range(2):
        low, high = Fraction(rectangle[axis]), Fraction(rectangle[axis + 2])
        step = end[axis] - start[axis]
        if step == 0:
            if not low <= start[axis] <= high:
                return False
            continue
        enter, leave = sorted(((low - start[axis]) / step, (high - start[axis]) / step))
        first, last = max(first, enter), min(last, leave)
    return first <= last


@given(coordinate, coordinate, coordinate, coordinate)
@settings(max_examples=400, deadline=None)
def test_no_touch_is_missed_and_none_is_invented(x0: float, y0: float, x1: float, y1: float) -> None:
    hit = kernels.hits_rectangle(x0, y0, x1, y1, *RECTANGLE)
    if touches_exactly(x0, y0, x1, y1, RECTANGLE):
        assert hit
    elif hit:  # allowed only where rounding hides the sign
        grown = (-0.5 - 1e-14, -0.25 - 1e-14, 0.5 + 1e-14, 0.25 + 1e-14)
        assert touches_exactly(x0, y0, x1, y1, grown)


@pytest.mark.parametrize(("segment", "hit"), [
    ((-1.0, 0.25, 1.0, 0.25), True),  # along the upper edge
    ((-1.0, np.nextafter(0.25, 1), 1.0, np.nextafter(0.25, 1)), False),  # the next number above it
    ((-0.75, 0.0, -0.25, 0.5), True),  # through the corner (-0.5, 0.25)
    ((-0.75, 0.0, -0.5, 0.25), True),  # ends in the corner
    ((-0.75, 0.0625, -0.25, 0.5625), False),  # past the corner
    ((0.5, 0.0, 0.5, 0.0), True),  # a point on the edge
    ((0.75, 0.0, 0.75, 0.0), False),
    ((-1.0, -1.0, 1.0, 1.0), True),  # right across
])
def test_touching_and_grazing(segment: tuple[float, ...], hit: bool) -> None:
    assert kernels.hits_rectangle(*segment, *RECTANGLE) is hit
    x0, y0, x1, y1 = segment
    assert kernels.hits_rectangle(x1, y1, x0, y0, *RECTANGLE) is hit


@given(st.floats(0.01, 0.1), st.floats(0.01, 0.1))
@settings(max_examples=300, deadline=None)
def test_a_touch_that_rounding_hides_is_no_miss(a: float, b: float) -> None:
    """The segment (-a, b)-(2a, -2b) goes through the corner (0, 0) exactly, but 3a and 3b are rounded."""
    assert touches_exactly(-a, b, 2 * a, -2 * b, (0.0, 0.0, 1.0, 1.0))
    assert kernels.hits_rectangle(-a, b, 2 * a, -2 * b, 0.0, 0.0, 1.0, 1.0)
    assert kernels.hits_rectangle(-a, b, 2 * a, -2 * b, -1.0, -1.0, 0.0, 0.0)


def make(**kwargs: object) -> MazeEnv:
    env = gymnasium.make("pbcs/Maze-v0", **kwargs).unwrapped  # type: ignore[arg-type]
    assert isinstance(env, MazeEnv)
    return env


def some_steps(env: MazeEnv, seed: int, count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Return valid states, many of them close to walls, and controls."""
    rng = np.random.default_rng(seed)
    states = rng.uniform(0.05, env.layout.size - 0.05, (4 * count, 2))
    states = states[env.is_valid(states)][:count]
    return states, rng.uniform(-0.15, 0.15, states.shape)


@pytest.mark.parametrize("response", ["stay", "slide"])
@pytest.mark.parametrize("size", [2, 3, 15])
def test_the_grid_loses_no_wall(size: int, response: str) -> None:
    env = make(size=size, maze_seed=size, collision_response=response)
    states, controls = some_steps(env, seed=1)
    after, hits = env.move(states, controls)
    targets = states + np.clip(controls, -0.1, 0.1)
    slow = [any(kernels.hits_rectangle(*p, *q, *wall) for wall in env.walls)
            for p, q in zip(states, targets, strict=True)]
    np.testing.assert_array_equal(hits, slow)
    np.testing.assert_array_equal(after[~hits], targets[~hits])
    moved = [any(kernels.hits_rectangle(*p, *q, *wall) for wall in env.walls)
             for p, q in zip(states, after, strict=True)]
    assert not np.any(moved)
    assert hits.any()
    if response == "stay":
        np.testing.assert_array_equal(after[hits], states[hits])


@pytest.mark.parametrize("options", [
    {}, {"collision_response": "slide"}, {"wall_penalty": -1.0}, {"normalize_actions": True},
    {"terminate_on_success": False}, {"collision": "fcl"},
])
def test_batch_single_and_env_step_are_bit_equal(options: dict[str, object]) -> None:
    env = make(size=5, maze_seed=2, **options)
    states, controls = some_steps(env, seed=2, count=200)
    states[:40] = env.goal + np.random.default_rng(0).uniform(-0.22, 0.22, (40, 2))
    batch = env.transition(states, controls)
    for k, (state, control) in enumerate(zip(states, controls, strict=True)):
        assert env.step_one(state.tolist(), control.tolist()) == batch.states[k].tolist()
        env.reset(options={"state": state})
        observation, reward, terminated, truncated, info = env.step(control)
        np.testing.assert_array_equal(observation, batch.states[k])
        assert (reward, terminated) == (batch.rewards[k], batch.terminated[k])
        assert info["success"] == batch.success[k]
        assert not truncated
    assert batch.success.any()
    np.testing.assert_array_equal(env.goal_distance(batch.states) < env.goal_threshold, batch.success)


@pytest.mark.parametrize("response", ["stay", "slide"])
def test_a_long_random_walk_stays_in_the_free_space(response: str) -> None:
    env = make(size=4, collision_response=response)
    rng = np.random.default_rng(0)
    states = np.tile(env.start, (50, 1))
    directions = rng.uniform(-0.1, 0.1, states.shape)
    for _ in range(300):
        redraw = rng.random(len(states)) < 0.1
        directions[redraw] = rng.uniform(-0.1, 0.1, (int(redraw.sum()), 2))
        states = env.transition(states, directions).states
        assert env.is_valid(states).all()


def test_slide_stops_short_of_the_wall_and_stay_does_not_move() -> None:
    slide, stay = make(collision_response="slide"), make()
    for start, action, contact in (((0.5, 0.9), (0.05, 0.1), 0.95), ((0.5, 0.9), (0.0, 0.1), 0.95)):
        after, hits = slide.move(np.array([start]), np.array([action]))
        assert hits[0]
        assert after[0, 1] == pytest.approx(contact - kernels.CLEARANCE, abs=1e-9)
        assert after[0, 0] == pytest.approx(start[0] + action[0] * (after[0, 1] - start[1]) / action[1])
        assert stay.step_one(list(start), list(action)) == list(start)
    touching = np.array([[0.5, 0.95 - kernels.CLEARANCE / 2]])
    np.testing.assert_array_equal(slide.move(touching, np.array([[0.0, 0.1]]))[0], touching)


@pytest.mark.parametrize("collision", ["kernel", "fcl"])
def test_rewards(collision: str) -> None:
    env = make(wall_penalty=-1.0, collision=collision)
    x, y, radius = env.goal_circle
    states = np.array([[x, y + radius + 0.05], [x, y + radius + 0.05], [0.5, 0.9], [x, 1.1]])
    controls = np.array([[0.0, -0.04], [0.0, -0.06], [0.0, 0.1], [0.0, 0.0]])
    result = env.transition(states, controls)
    np.testing.assert_array_equal(result.success, [False, True, False, False])
    np.testing.assert_array_equal(result.terminated, [False, True, False, False])
    np.testing.assert_array_equal(result.rewards, [0.0, 1.0, -1.0, 0.0])
    into_the_wall_in_the_goal = env.transition([[0.1, 1.5]], [[-0.1, 0.0]])
    assert not into_the_wall_in_the_goal.success[0]
    near_goal = make(wall_penalty=-1.0, goal=[0.1, 1.5], collision=collision)
    closer = near_goal.transition([[0.1, 1.5]], [[-0.1, 0.0]])
    assert closer.rewards[0] == 0.0  # 1 for the goal, -1 for the wall
    assert closer.success[0]


def test_the_goal_is_open() -> None:
    env = make(goal=[0.5, 0.5])
    on_the_edge = env.transition([[0.5, 0.75]], [[0.0, -0.05]])
    assert on_the_edge.states[0, 1] == 0.7
    assert bool(on_the_edge.success[0]) == (env.goal_distance(on_the_edge.states)[0] < 0.2)


def test_nan_comes_out_as_nan_on_the_fast_path() -> None:
    env = make()
    assert np.isnan(env.step_one([np.nan, 0.5], [0.1, 0.1])).any()
    assert np.isnan(env.step_one([0.5, 0.5], [0.1, np.nan])).any()
    assert env.step_one([0.5, 0.5], [np.inf, 0.0]) == [0.6, 0.5]
