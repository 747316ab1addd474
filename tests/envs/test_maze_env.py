"""The options of the maze environment, its pictures, and what it refuses."""

import copy
import json
import pickle
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

import envs  # noqa: F401 - registers
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.envs.maze.kernels import CLEARANCE
from pbcs_ompl.envs.maze.layout import MazeLayout


def make(**kwargs: object) -> gymnasium.Env:
    return gymnasium.make("pbcs/Maze-v0", **kwargs).unwrapped  # type: ignore[arg-type]


@pytest.mark.parametrize(("size", "goal"), [(2, (0.5, 1.5)), (3, (2.5, 2.5)), (50, (49.5, 49.5))])
def test_start_and_goal_of_the_thesis(size: int, goal: tuple[float, float]) -> None:
    env = make(size=size)
    observation, info = env.reset(seed=0)
    np.testing.assert_array_equal(observation, [0.5, 0.5])
    assert env.goal_circle == (*goal, 0.2)
    assert info == {"is_success": False, "success": False, "hit_wall": False,
                    "distance_to_goal": pytest.approx(np.hypot(goal[0] - 0.5, goal[1] - 0.5))}
    assert env.is_valid(np.array([observation, goal])).all()


def test_the_episode_seed_does_not_change_the_maze() -> None:
    env = make(size=6, maze_seed=3)
    walls = env.walls.copy()
    env.reset(seed=99)
    np.testing.assert_array_equal(env.walls, walls)
    np.testing.assert_array_equal(make(size=6, maze_seed=3).walls, walls)


def test_a_drawing_makes_the_same_maze_as_its_size() -> None:
    drawing = MazeLayout.from_size(5, 7).draw()
    custom = make(layout=drawing)
    np.testing.assert_array_equal(custom.walls, make(size=5, maze_seed=7).walls)
    assert json.loads(custom.spec.to_json())["kwargs"]["layout"] == drawing
    with pytest.raises(InvalidOption, match="leave size out"):
        make(size=4, layout=drawing)


def test_the_literal_mdp_has_no_terminal_states() -> None:
    env = make(goal=[0.5, 0.5], terminate_on_success=False)
    env.reset()
    _, reward, terminated, _, info = env.step(np.zeros(2))
    assert (reward, terminated, info["is_success"]) == (1.0, False, True)


def test_normalised_actions_are_ten_times_as_large() -> None:
    plain, normalised = make(), make(normalize_actions=True)
    actions = np.random.default_rng(0).uniform(-1.2, 1.2, (100, 2))
    states = np.tile([0.5, 0.5], (100, 1))
    np.testing.assert_allclose(normalised.transition(states, actions).states,
                               plain.transition(states, actions * 0.1).states, atol=1e-15)
    np.testing.assert_array_equal(normalised.action_space.high, [1.0, 1.0])


@pytest.mark.parametrize("normalised", [False, True])
def test_advance_towards_reaches_the_target(normalised: bool) -> None:
    env = make(normalize_actions=normalised)
    states, targets = np.tile([0.5, 0.5], (3, 1)), np.array([[0.55, 0.47], [1.4, 0.6], [0.5, 0.5]])
    for _ in range(15):
        controls = env.advance_towards(states, targets)
        assert env.action_space.contains(controls[0])
        states = env.transition(states, controls).states
    np.testing.assert_allclose(states, targets, atol=1e-12)


def test_fcl_slides_to_the_same_contact_as_the_kernel() -> None:
    kernel, fcl = (make(size=4, collision_response="slide", collision=c) for c in ("kernel", "fcl"))
    rng = np.random.default_rng(5)
    states = rng.uniform(0.06, 3.94, (400, 2))
    states = states[kernel.is_valid(states)]
    controls = rng.uniform(-0.1, 0.1, states.shape)
    controls[np.abs(controls) < 0.02] = 0.02  # no grazing: there the two clearances differ
    (mine, hits), (theirs, fcl_hits) = kernel.move(states, controls), fcl.move(states, controls)
    np.testing.assert_array_equal(hits, fcl_hits)
    np.testing.assert_allclose(mine, theirs, atol=10 * CLEARANCE)
    assert hits.sum() > 20
    assert fcl.is_valid(theirs).all()


@pytest.mark.parametrize(("options", "complaint"), [
    ({"collision_response": "slid"}, "did you mean 'slide'"),
    ({"collision": "numba"}, "collision='numba'"),
    ({"wall_penalty": 1.0}, "wall_penalty=1.0"),
    ({"wall_penalty": float("nan")}, "wall_penalty"),
    ({"size": 0}, "from 2 to 50"),
])
def test_options_out_of_range(options: dict[str, object], complaint: str) -> None:
    with pytest.raises(InvalidOption, match=complaint):
        make(**options)


@pytest.mark.parametrize(("options", "complaint"), [
    ({"start": [0.5, 1.0]}, r"start=\[0.5, 1.0\] is inside a wall"),
    ({"goal": [0.0, 0.5]}, "goal.*inside a wall"),
    ({"goal": [2.5, 0.5]}, "goal.*outside"),
    ({"start": [0.5]}, "two finite numbers"),
    ({"start": ["a", 1]}, "two numbers"),
    ({"start": [0.5, float("inf")]}, "two finite numbers"),
])
def test_impossible_starts_and_goals(options: dict[str, object], complaint: str) -> None:
    with pytest.raises(InvalidState, match=complaint):
        make(**options)


def test_reset_to_a_state() -> None:
    env = make()
    observation, info = env.reset(options={"state": [0.5, 1.4]})
    np.testing.assert_array_equal(observation, [0.5, 1.4])
    assert info["success"]
    with pytest.raises(InvalidState, match="inside a wall"):
        env.reset(options={"state": [0.5, 1.0]})
    with pytest.raises(InvalidOption, match="sate"):
        env.reset(options={"sate": [0.5, 1.4]})


def test_bad_batches_are_refused_at_the_border() -> None:
    env = make()
    with pytest.raises(InvalidState, match=r"\[B, 2\], got \[1, 3\]"):
        env.transition([[0.5, 0.5, 0.0]], [[0.0, 0.0]])
    with pytest.raises(InvalidState, match="row 1 is not finite"):
        env.transition([[0.5, 0.5], [np.nan, 0.5]], np.zeros((2, 2)))
    with pytest.raises(InvalidOption, match="controls: row 0 is not finite"):
        env.transition([[0.5, 0.5]], [[np.inf, 0.0]])
    with pytest.raises(InvalidOption, match="1 controls for 2 states"):
        env.transition(np.full((2, 2), 0.5), np.zeros((1, 2)))
    assert env.transition(np.empty((0, 2)), np.empty((0, 2))).states.shape == (0, 2)


def test_validity_is_bounds_and_walls() -> None:
    env = make()
    good = [[0.5, 0.5], [0.051, 0.5], [0.5, 1.051]]
    bad = [[0.05, 0.5], [-0.1, 0.5], [0.5, 2.1], [0.5, 1.0], [np.nan, 0.5]]
    assert env.is_valid(np.array(good)).all()
    assert not env.is_valid(np.array(bad)).any()


def test_a_copy_is_independent_and_reaches_the_same() -> None:
    env = make(size=4, maze_seed=1)
    env.reset(options={"state": [1.5, 0.5]})
    for copied in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        before = env.get_env_state()
        mine, theirs = env.step(np.array([0.03, -0.02])), copied.step(np.array([0.03, -0.02]))
        np.testing.assert_array_equal(mine[0], theirs[0])
        env.set_env_state(before)
        assert not np.array_equal(copied.get_env_state(), before)


def test_pictures_show_walls_goal_and_point() -> None:
    env = make(size=3, render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert picture.shape == (480, 480, 3)
    assert picture.dtype == np.uint8

    def colour(x: float, y: float) -> tuple[int, ...]:
        return tuple(picture[479 - int(y * 160), int(x * 160)].tolist())

    assert colour(0.5, 0.5) == (205, 50, 50)
    assert colour(2.5, 2.5) == (120, 200, 120)
    assert colour(0.5, 1.0) == colour(0.01, 0.5) == (40, 40, 46)
    assert colour(1.5, 0.5) == (255, 255, 255)
    drawn = make(size=3, render_mode="ansi")
    drawn.reset()
    assert drawn.render().splitlines()[1] == "|    G|"
    assert drawn.render().splitlines()[-2] == "|A    |"
    assert make().render() is None


def test_vector_environments_work() -> None:
    vector = gymnasium.make_vec("pbcs/Maze-v0", num_envs=3, vectorization_mode="sync", size=4)
    observations, _ = vector.reset(seed=1)
    assert observations.shape == (3, 2)
    assert vector.step(vector.action_space.sample())[4]["hit_wall"].shape == (3,)
    vector.close()


def test_importing_envs_is_light() -> None:
    code = "import pbcs_ompl.envs, sys; print([m for m in ('numba', 'fcl', 'scipy') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
