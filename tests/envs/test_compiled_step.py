"""The step that compiled planners call is the same step."""

import gymnasium
import numpy as np
import pytest

import envs  # noqa: F401 - registers


@pytest.mark.parametrize(("env_id", "options"), [
    ("pbcs/Maze-v0", {"size": 5}),
    ("pbcs/Maze-v0", {"collision_response": "slide", "wall_penalty": -1.0}),
    ("pbcs/Maze-v0", {"normalize_actions": True}),
    ("pbcs/Maze-v0", {"terminate_on_success": False}),
    ("pbcs/Box-v0", {"goal": [2.0, 2.0]}),
    ("pbcs/Disc-v0", {}),
])
def test_it_equals_transition_bit_for_bit(env_id: str, options: dict[str, object]) -> None:
    env = gymnasium.make(env_id, **options).unwrapped  # type: ignore[arg-type]
    step, settings, table, integers = env.compiled_step()
    rng = np.random.default_rng(0)
    states = rng.uniform(0.0, env.state_high, (2000, 2))
    if env.goal is not None:
        states[:300] = env.goal + rng.uniform(-0.25, 0.25, (300, 2))
    controls = rng.uniform(-1.5, 1.5, (2000, 2)) * env.action_space.high
    expected = env.transition(states, controls)
    rows, given = np.concatenate([states, np.zeros_like(states)]), np.concatenate([controls, controls])
    for k in range(2000):
        outcome = step(settings, table, integers, rows, k, given, 2000 + k)
        assert outcome == (expected.rewards[k], expected.terminated[k], expected.success[k])
    np.testing.assert_array_equal(rows[2000:], expected.states)
    np.testing.assert_array_equal(rows[:2000], states)


@pytest.mark.parametrize(("env_id", "options"), [
    ("pbcs/Maze-v0", {"size": 5, "wall_penalty": -1.0}),
    ("pbcs/Maze-v0", {"collision": "fcl"}),
    ("pbcs/Maze-v0", {"collision_response": "slide", "normalize_actions": True}),
    ("pbcs/Box-v0", {"goal": [2.0, 2.0]}),
    ("pbcs/Disc-v0", {}),
])
def test_the_step_of_gymnasium_equals_transition_bit_for_bit(env_id: str, options: dict[str, object]) -> None:
    env = gymnasium.make(env_id, **options).unwrapped  # type: ignore[arg-type]
    rng = np.random.default_rng(1)
    state, _ = env.reset(seed=0)
    for action in rng.uniform(-1.5, 1.5, (300, 2)) * env.action_space.high:
        expected = env.transition(state[None], action[None])
        distance = env.goal_distance(expected.states)[0]
        state, reward, terminated, truncated, info = env.step(action)
        np.testing.assert_array_equal(state, expected.states[0])
        assert (reward, terminated, truncated) == (expected.rewards[0], expected.terminated[0], False)
        assert (info["success"], info["distance_to_goal"]) == (expected.success[0], distance)
        assert isinstance(reward, float)
        assert isinstance(terminated, bool)


def test_fcl_offers_none() -> None:
    assert gymnasium.make("pbcs/Maze-v0", collision="fcl").unwrapped.compiled_step() is None
