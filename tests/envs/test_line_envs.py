"""1D-Toy and Drift: the equations of the thesis, on batches and one by one."""

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import envs  # noqa: F401 - registers
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.resettable import make

TOY, DRIFT = make("pbcs/Toy1D-v0"), make("pbcs/Drift-v0")
position = st.floats(0.0, 1.0)
action = st.floats(-0.1, 0.1)


@given(position, action)
def test_toy_rewards_and_ends_exactly_below_zero(s: float, a: float) -> None:
    outcome = TOY.transition(np.array([[s]]), np.array([[a]]))
    rewarded = s + a < 0.0
    assert outcome.rewards[0] == rewarded
    assert outcome.terminated[0] == outcome.success[0] == rewarded
    assert outcome.states[0, 0] == min(1.0, s + a)


@given(position, action)
def test_drift_moves_like_toy_and_never_rewards(s: float, a: float) -> None:
    outcome = DRIFT.transition(np.array([[s]]), np.array([[a]]))
    assert outcome.states[0, 0] == min(1.0, max(0.0, s + a))
    assert not np.any([outcome.rewards, outcome.terminated, outcome.success])


@given(st.floats(-0.1, 1.0))
def test_a_state_is_a_success_if_and_only_if_it_is_near_the_goal(s: float) -> None:
    for model in (TOY, DRIFT):
        near = model.goal_distance(np.array([[s]]))[0] < model.goal_threshold
        assert near == (s < 0.0 and model is TOY)


def test_actions_are_clipped() -> None:
    wild = TOY.transition(np.full((2, 1), 0.5), np.array([[7.0], [-7.0]]))
    np.testing.assert_array_equal(wild.states[:, 0], [0.6, 0.4])


def test_an_episode_lasts_fifty_steps_at_most() -> None:
    env = gymnasium.make("pbcs/Toy1D-v0")
    env.reset(seed=0)
    ends = [env.step(np.array([0.1]))[2:4] for _ in range(50)]
    assert ends[:49] == [(False, False)] * 49
    assert ends[49] == (False, True)


def test_a_planner_finds_the_reward() -> None:
    result = plan("pbcs/Toy1D-v0", "Ex", seed=1, max_transitions=1000)
    assert result.solved
    assert result.replay_ok


@pytest.mark.parametrize("state", [[1.5], [-0.2], [np.nan], [0.0, 0.0]])
def test_impossible_states_are_named(state: list[float]) -> None:
    with pytest.raises(InvalidState):
        gymnasium.make("pbcs/Toy1D-v0").unwrapped.reset(options={"state": state})


@pytest.mark.parametrize("controls", [np.zeros((1, 2)), np.full((1, 1), np.inf), np.zeros((2, 1))])
def test_impossible_controls_are_named(controls: np.ndarray) -> None:
    with pytest.raises(InvalidOption):
        TOY.transition(np.zeros((1, 1)), controls)
