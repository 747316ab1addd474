"""The ant in a maze and the cheetah that has to be fast."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.core.rendering import prefer_headless_rendering

prefer_headless_rendering()
mujoco = pytest.importorskip("mujoco")

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.envs.ant_maze import AntMazeEnv
from pbcs_ompl.envs.maze.layout import MazeLayout
from pbcs_ompl.envs.sparse_half_cheetah import CHEETAH, X_SPEED, SparseHalfCheetahEnv, X, cheetah

ENVS = [AntMazeEnv, SparseHalfCheetahEnv]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes MUJOCO_LOG.TXT into the working directory when it reads Gymnasium's cheetah."""
    monkeypatch.chdir(tmp_path)


def episode(env: Any, steps: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, list[Any]]:
    """Return the states [T, D], controls [T, A] and answers of `step` in a random episode."""
    rng = np.random.default_rng(seed)
    env.reset(seed=seed)
    states, answers = [], []
    controls = rng.uniform(env.action_space.low, env.action_space.high, (steps, env.model.nu))
    for control in controls:
        states.append(env.get_env_state())
        answers.append(env.step(control))
    return np.array(states), controls, answers


@pytest.mark.parametrize("kind", ENVS)
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_a_batch_on_threads_is_the_episode(kind: Any, threads: int) -> None:
    states, controls, answers = episode(kind(), 40)
    for size in (1, 2, 7, 40):
        after = kind(threads=threads).transition(states[:size], controls[:size])
        np.testing.assert_array_equal(after.states[:-1], states[1:size])
        np.testing.assert_array_equal(after.rewards, [answer[1] for answer in answers[:size]])
        np.testing.assert_array_equal(after.success, [answer[4]["is_success"] for answer in answers[:size]])


def test_a_planned_tree_is_the_same_on_any_threads_and_every_edge_is_one_step_of_the_environment() -> None:
    trees = [plan("pbcs/AntMaze-v0", "Ex", env_kwargs={"threads": threads}, seed=3, max_transitions=400).tree
             for threads in (1, 2, 3)]
    for tree in trees[1:]:
        np.testing.assert_array_equal(tree.states, trees[0].states)
        np.testing.assert_array_equal(tree.parents, trees[0].parents)
    states, parents, controls = trees[0].states, trees[0].parents, trees[0].controls
    assert controls is not None
    env = AntMazeEnv()
    env.reset(seed=7)
    for node in range(1, len(states)):
        env.set_env_state(states[parents[node]])
        env.step(controls[node])
        np.testing.assert_array_equal(env.get_env_state(), states[node])


@pytest.mark.parametrize(("kind", "env_id"), [(AntMazeEnv, "Ant-v5"), (SparseHalfCheetahEnv, "HalfCheetah-v5")])
def test_physics_is_gymnasiums_up_to_the_warm_start(kind: Any, env_id: str) -> None:
    theirs: Any = gymnasium.make(env_id).unwrapped
    ours = kind()
    ours.reset(seed=0)
    theirs.reset(seed=0)
    qpos, qvel = ours.data.qpos.copy(), ours.data.qvel.copy()
    theirs.set_state(qpos, qvel)
    rng = np.random.default_rng(0)
    for _ in range(8):
        action = rng.uniform(-1.0, 1.0, ours.model.nu)
        ours.step(action)
        theirs.step(action)
    np.testing.assert_allclose(ours.data.qpos, theirs.data.qpos, atol=1e-6)


def test_the_walls_are_those_of_the_maze() -> None:
    env = AntMazeEnv(size=3, cell_size=5.0)
    np.testing.assert_allclose(env.walls, MazeLayout.from_size(3).rectangles * 5.0)
    boxes = [k for k in range(env.model.ngeom) if int(env.model.geom_type[k]) == int(mujoco.mjtGeom.mjGEOM_BOX)]
    assert len(boxes) == len(env.walls)
    for k, (x0, y0, x1, y1) in zip(boxes, env.walls, strict=True):
        np.testing.assert_allclose(env.model.geom_pos[k][:2], [(x0 + x1) / 2, (y0 + y1) / 2])
        np.testing.assert_allclose(env.model.geom_size[k][:2], [(x1 - x0) / 2, (y1 - y0) / 2])
    assert min(x1 - x0 for x0, _, x1, _ in env.walls) == pytest.approx(0.5)


def test_walls_stop_the_ant() -> None:
    env = AntMazeEnv(reset_noise=0.0)
    env.reset(seed=0)
    state = env.get_env_state()
    state[15 + 1] = -8.0  # the speed along x, behind time and positions
    places = []
    for _ in range(60):
        state = env.transition(state[None], np.zeros((1, 8))).states[0]
        places.append(state[1])
    assert 0.2 < min(places) < 1.9


def test_the_goal_of_the_small_maze_is_above_the_start() -> None:
    env = AntMazeEnv(reset_noise=0.0)
    _, info = env.reset(seed=0)
    assert env.goal.tolist() == [2.0, 6.0]
    assert info["distance_to_goal"] == pytest.approx(4.0)
    state = env.get_env_state()
    state[1:3] = [2.0, 6.5]
    outcome = env.transition(state[None], np.zeros((1, 8)))
    assert outcome.success[0]
    assert outcome.terminated[0]
    assert outcome.rewards[0] == 1.0
    assert not AntMazeEnv(terminate_on_success=False).transition(state[None], np.zeros((1, 8))).terminated[0]


def test_an_ant_in_a_wall_is_no_state() -> None:
    env = AntMazeEnv()
    env.reset(seed=0)
    states = np.tile(env.get_env_state(), (3, 1))
    states[1, 1:3] = [2.0, 4.0]
    states[2, 1] = -1.0
    np.testing.assert_array_equal(env.is_valid(states), [True, False, False])


@pytest.mark.parametrize("kwargs", [{"cell_size": 1.0}, {"size": 0}, {"reset_noise": -1.0}, {"threads": 0},
                                    {"render_mode": "human"}, {"cell_size": float("nan")}])
def test_bad_options(kwargs: dict[str, Any]) -> None:
    with pytest.raises(InvalidOption):
        AntMazeEnv(**kwargs)


def test_bad_states_and_actions() -> None:
    env = AntMazeEnv()
    env.reset(seed=0)
    with pytest.raises(InvalidState):
        env.set_env_state(np.zeros(3))
    with pytest.raises(InvalidState):
        env.transition(np.full((2, 30), np.nan), np.zeros((2, 8)))
    with pytest.raises(InvalidOption):
        env.transition(np.zeros((2, 30)), np.zeros((3, 8)))
    with pytest.raises(InvalidOption):
        env.step(np.zeros(3))
    with pytest.raises(InvalidOption):
        env.reset(options={"stat": np.zeros(30)})


def test_the_cheetah_weighs_what_gymnasiums_does(capfd: pytest.CaptureFixture[str]) -> None:
    theirs = mujoco.MjModel.from_xml_path(str(CHEETAH))
    capfd.readouterr()
    ours = cheetah()
    assert capfd.readouterr().err == ""
    for name in ("body_mass", "body_inertia", "dof_invweight0", "body_invweight0"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


def test_only_speed_is_rewarded() -> None:
    env = SparseHalfCheetahEnv(reset_noise=0.0)
    env.reset(seed=0)
    slow, fast = env.get_env_state(), env.get_env_state()
    fast[X_SPEED] = 6.0
    outcome = env.transition(np.array([slow, fast]), np.zeros((2, 6)))
    np.testing.assert_array_equal(outcome.rewards, [0.0, 2.0])
    speed = (outcome.states[:, X] - 0.0) / 0.05
    np.testing.assert_array_equal(outcome.rewards > 0, speed > 2.0)
    np.testing.assert_array_equal(outcome.success, outcome.states[:, X_SPEED] > 2.0)
    assert not outcome.terminated.any()
    assert gymnasium.make("pbcs/SparseHalfCheetah-v0").spec.max_episode_steps == 1000  # type: ignore[union-attr]


def test_perturbed_ants_stand_on_their_feet() -> None:
    from pbcs_ompl.resettable import make

    model = make("pbcs/AntMaze-v0")
    state = model.initial_state(0)
    drawn = model.perturb(state, 1.0, 10, np.random.default_rng(0))
    assert drawn.shape == (10, 30)
    assert (model.distance(drawn, state) <= 1.0).all()


def test_ex_explores_and_replays_bit_for_bit() -> None:
    result = plan("pbcs/SparseHalfCheetah-v0", "Ex", seed=0, max_transitions=20_000)
    assert result.solved
    assert result.replay_ok


@pytest.mark.slow
def test_ex_solves_the_ant_maze() -> None:
    result = plan("pbcs/AntMaze-v0", "Ex", seed=0, max_transitions=600_000)
    assert result.solved
    assert result.replay_ok
