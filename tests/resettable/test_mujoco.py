"""MuJoCo-based environments of Gymnasium and gymnasium-robotics."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.core.rendering import prefer_headless_rendering

prefer_headless_rendering()
pytest.importorskip("mujoco")

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidState, MissingDependency
from pbcs_ompl.resettable import check_resettable, make
from pbcs_ompl.resettable.adapters.mujoco import MujocoEnv, MujocoModel

GYMNASIUM = ["Ant-v5", "Hopper-v5", "InvertedDoublePendulum-v5", "Reacher-v5"]
ROBOTICS = ["PointMaze_UMaze-v3", "AntMaze_UMaze-v5", "AdroitHandHammer-v1"]


@pytest.fixture(params=[*GYMNASIUM, *(pytest.param(name, marks=pytest.mark.slow) for name in ROBOTICS)],
                scope="module")
def model(request: pytest.FixtureRequest) -> Any:
    if request.param in ROBOTICS:
        pytest.importorskip("gymnasium_robotics")
    return make(request.param)


def chain_of(model: Any, steps: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return the states [T, D] and controls [T, A] of a random episode."""
    rng = np.random.default_rng(seed)
    controls = rng.uniform(model.action_low, model.action_high, (steps, len(model.action_low)))
    states = [model.initial_state(seed)]
    for control in controls[:-1]:
        states.append(model.transition(states[-1][None], control[None]).states[0])
    return np.array(states), controls


def test_it_is_resettable(model: Any) -> None:
    report = check_resettable(model)
    assert report.ok, str(report)


def test_physics_is_that_of_the_environment_itself(model: Any) -> None:
    raw: Any = gymnasium.make(model.spec.id).unwrapped
    raw.reset(seed=3)
    state = model.initial_state(3)
    rng = np.random.default_rng(0)
    for _ in range(30):
        action = rng.uniform(raw.action_space.low, raw.action_space.high).astype(raw.action_space.dtype)
        raw.step(action)
        state = model.transition(state[None], action[None].astype(float)).states[0]
        model.env.set_env_state(state)
        np.testing.assert_array_equal(model.env.inner.data.qpos, raw.data.qpos)
        np.testing.assert_array_equal(model.env.inner.data.qvel, raw.data.qvel)


def test_a_step_shows_what_its_restored_state_shows(model: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    states, controls = chain_of(model, 12)
    after = model.transition(states, controls).states
    restored = model.env.observe(after)
    mixed = np.concatenate([after[:3], states[:1]])
    np.testing.assert_array_equal(model.observe(mixed), np.concatenate([restored[:3], model.env.observe(states[:1])]))
    monkeypatch.setattr(model, "_observe", None)  # no state is restored for what was seen
    np.testing.assert_array_equal(model.observe(after), restored)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_batch_and_threads_change_nothing(threads: int) -> None:
    one = make("Ant-v5")
    many = MujocoModel(MujocoEnv(gymnasium.make("Ant-v5").unwrapped), threads)
    states, controls = chain_of(one, 13)
    expected = [one.transition(state[None], control[None]) for state, control in zip(states, controls, strict=True)]
    found = many.transition(states, controls)
    for name in found._fields:
        np.testing.assert_array_equal(getattr(found, name), np.concatenate([getattr(step, name) for step in expected]))


def test_the_goal_is_a_part_of_the_state() -> None:
    pytest.importorskip("gymnasium_robotics")
    first, second = make("PointMaze_UMaze-v3"), make("PointMaze_UMaze-v3")
    state = first.initial_state(1)
    second.initial_state(2)
    assert first.env.inner.goal.tolist() != second.env.inner.goal.tolist()  # type: ignore[attr-defined]
    second.observe(state[None])
    assert first.env.inner.goal.tolist() == second.env.inner.goal.tolist()  # type: ignore[attr-defined]


def test_mazes_know_their_walls_bounds_and_distance() -> None:
    pytest.importorskip("gymnasium_robotics")
    model = make("PointMaze_UMaze-v3")
    np.testing.assert_array_equal(model.feature_low, [-2.5, -2.5])
    assert model.walls.shape == (18, 4)
    assert model.goal_threshold == 0.45
    state = model.initial_state(0)[None]
    seen = model.observe(state)[0]
    assert model.goal_distance(state)[0] == pytest.approx(np.linalg.norm(seen[:2] - seen[2:4]))


def test_turns_of_a_free_joint_are_angles() -> None:
    model = make("Ant-v5")
    state = model.initial_state(0)
    turned = state.copy()
    turned[6:10] *= -1.0  # the quaternion of the same orientation, behind feature [2], time and position [3]
    assert np.linalg.norm(state - turned) > 1.0
    assert model.distance(turned[None], state)[0] == pytest.approx(0.0, abs=1e-7)


def test_a_point_maze_is_solved_and_replayed() -> None:
    pytest.importorskip("gymnasium_robotics")
    result = plan("PointMaze_UMaze-v3", "Ex", seed=0, max_transitions=50_000)
    assert result.solved
    assert result.replay_ok


def test_states_of_another_kind_are_refused() -> None:
    model = make("Ant-v5")
    with pytest.raises(InvalidState):
        model.transition(np.full((1, len(model.state_low)), np.nan), np.zeros((1, 8)))
    with pytest.raises(InvalidState):
        model.transition(np.zeros((1, 3)), np.zeros((1, 8)))


def test_what_the_installed_mujoco_cannot_run_is_named() -> None:
    pytest.importorskip("gymnasium_robotics")
    import mujoco

    if tuple(map(int, mujoco.__version__.split(".")[:2])) > (3, 8):
        with pytest.raises(MissingDependency, match=r"mujoco<=3\.8"):
            make("FetchReach-v4")
    else:
        assert check_resettable(make("FetchReach-v4")).ok


def test_the_bug_of_mujoco_4_0_0_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    import mujoco

    monkeypatch.setattr(mujoco, "__version__", "4.0.0")
    monkeypatch.setattr(mujoco, "mj_isSparse", lambda model: 1)
    with pytest.warns(UserWarning, match=r"sparse; install mujoco 4\.0\.1"):
        make("InvertedPendulum-v5")


def test_what_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "gymnasium_robotics", None)
    for env_id in [name for name in gymnasium.registry if name.startswith("PointMaze")]:
        monkeypatch.delitem(gymnasium.registry, env_id)
    with pytest.raises(MissingDependency, match=r"pbcs-ompl\[robotics\]"):
        make("PointMaze_UMaze-v3")
