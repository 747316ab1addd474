"""The box and the disc: what is refused does not move, or hardly, and always by the same."""

import gymnasium
import numpy as np
import pytest

import envs  # noqa: F401 - registers
from pbcs_ompl.core.errors import InvalidOption, InvalidState

IDS = ["pbcs/Box-v0", "pbcs/Disc-v0"]


def make(env_id: str, **kwargs: object) -> gymnasium.Env:
    return gymnasium.make(env_id, **kwargs).unwrapped  # type: ignore[arg-type]


def some_steps(env: gymnasium.Env, count: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    states = rng.uniform(0.0, 5.0, (20 * count, 2))
    away = states - env.start
    border = env.start + 1.24 * away / np.linalg.norm(away, axis=1, keepdims=True)
    states = np.concatenate([states, border, np.abs(states) % 0.1])
    states = rng.permutation(states[env.is_valid(states)])[:count]
    return states, rng.uniform(-0.1, 0.1, states.shape)


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("options", [{}, {"goal": [1.5, 1.5]}, {"normalize_actions": True}])
def test_batch_single_and_env_step_are_bit_equal(env_id: str, options: dict[str, object]) -> None:
    env = make(env_id, **options)
    states, controls = some_steps(env, 300)
    batch = env.transition(states, controls)
    for k, (state, control) in enumerate(zip(states, controls, strict=True)):
        assert env.step_one(state.tolist(), control.tolist()) == batch.states[k].tolist()
        env.set_env_state(state)
        observation, reward, terminated, _, info = env.step(control)
        np.testing.assert_array_equal(observation, batch.states[k])
        assert (reward, terminated) == (batch.rewards[k], batch.terminated[k])
        assert info["success"] == batch.success[k]


@pytest.mark.parametrize("env_id", IDS)
def test_points_stay_where_they_can_be(env_id: str) -> None:
    env = make(env_id)
    states, _ = some_steps(env)
    rng = np.random.default_rng(1)
    for _ in range(50):
        states = env.transition(states, rng.uniform(-0.1, 0.1, states.shape)).states
        assert env.is_valid(states).all()


def test_the_box_refuses_what_leaves_it() -> None:
    env = make("pbcs/Box-v0")
    states, controls = some_steps(env)
    after, hits = env.move(states, controls)
    leaves = ~env.is_valid(states + controls)
    np.testing.assert_array_equal(hits, leaves)
    np.testing.assert_array_equal(after, np.where(leaves[:, None], states, states + controls))
    assert leaves.any()


@pytest.mark.parametrize("perturbation", [0.01, 0.001, 0.0])
def test_the_disc_perturbs_what_leaves_it(perturbation: float) -> None:
    env = make("pbcs/Disc-v0", perturbation=perturbation)
    states, controls = some_steps(env)
    after, hits = env.move(states, controls)
    leaves = np.linalg.norm(states + controls - env.start, axis=1) > 1.25
    np.testing.assert_array_equal(hits, leaves)
    np.testing.assert_array_equal(after[~leaves], (states + controls)[~leaves])
    noise = after[leaves] - states[leaves]
    assert (np.abs(noise) <= perturbation + 1e-15).all()
    assert leaves.sum() > 100
    if perturbation:
        assert len(np.unique(noise, axis=0)) > 0.3 * len(noise)  # the others were kept in the disc
        assert np.abs(noise.mean(axis=0)).max() < perturbation / 2
    again, _ = make("pbcs/Disc-v0", perturbation=perturbation).move(states, controls)
    np.testing.assert_array_equal(after, again)


@pytest.mark.parametrize("env_id", IDS)
def test_without_a_goal_nothing_is_rewarded(env_id: str) -> None:
    env = make(env_id)
    result = env.transition(*some_steps(env))
    assert not result.rewards.any()
    assert not result.terminated.any()
    assert not result.success.any()
    assert env.goal_circle is None
    assert np.isinf(env.goal_distance(result.states)).all()


@pytest.mark.parametrize("env_id", IDS)
def test_a_goal_is_reached(env_id: str) -> None:
    env = make(env_id, start=[1.45, 1.5], goal=[2.0, 1.5])
    state = np.array([env.start])
    rewards = []
    for _ in range(5):  # 0.55 away, radius 0.2, steps of 0.1
        result = env.transition(state, env.advance_towards(state, np.array([[2.0, 1.5]])))
        state = result.states
        rewards.append(result.rewards[0])
    assert rewards == [0.0, 0.0, 0.0, 1.0, 1.0]
    assert result.terminated[0]


@pytest.mark.parametrize(("env_id", "options", "error", "complaint"), [
    ("pbcs/Box-v0", {"start": [6.0, 1.0]}, InvalidState, "outside"),
    ("pbcs/Disc-v0", {"start": [4.0, 4.0]}, InvalidState, "outside of the disc"),
    ("pbcs/Disc-v0", {"goal": [4.0, 4.0]}, InvalidState, "goal"),
    ("pbcs/Disc-v0", {"radius": 2.0}, InvalidOption, "within"),
    ("pbcs/Disc-v0", {"radius": -1.0}, InvalidOption, "within"),
    ("pbcs/Disc-v0", {"perturbation": 0.5}, InvalidOption, "from 0 to 0.1"),
])
def test_impossible_options(env_id: str, options: dict[str, object], error: type[Exception],
                            complaint: str) -> None:
    with pytest.raises(error, match=complaint):
        make(env_id, **options).reset()


def test_the_ground_outside_of_the_disc_is_dark() -> None:
    env = make("pbcs/Disc-v0", render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert tuple(picture[10, 470]) == (40, 40, 46)
    assert (picture == 255).all(axis=2).mean() == pytest.approx(np.pi * 1.25**2 / 25, abs=0.01)
