"""Each diagnostic on functions with a known result."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl import diagnostics as d
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.resettable import make

LOW, HIGH = np.array([-0.1]), np.array([0.1])
STATES = np.linspace(0.0, 1.0, 50)[None, :, None]
ACTIONS = np.random.default_rng(0).uniform(-0.1, 0.1, (1, 50, 1))


def constant(action):
    return lambda observations: np.full((*observations.shape[:2], 1), action)


def theorem_1(observations, actions):
    """Q(s, a) = 1 where s + a < 0: the critic of the deadlock in 1D-Toy."""
    return ((observations + actions)[..., 0] < 0.0).astype(float)


def slanted(observations, actions):
    return -3.0 * actions[..., 0]


def test_saturation_counts_components_at_the_ends():
    act = lambda observations: np.tile([0.1, 0.0], (*observations.shape[:2], 1))  # noqa: E731
    share = d.saturation(act, STATES, np.array([-0.1, -0.1]), np.array([0.1, 0.1]))
    np.testing.assert_array_equal(share, [0.5])
    assert d.saturation(constant(-0.1), STATES, LOW, HIGH) == 1.0
    assert d.saturation(constant(0.05), STATES, LOW, HIGH) == 0.0


def test_largest_actions_and_values():
    assert d.largest_actions(constant(-0.07), STATES) == pytest.approx([0.07])
    assert d.largest_values(slanted, STATES, ACTIONS) == pytest.approx([3.0 * np.abs(ACTIONS).max()])


@settings(max_examples=30)
@given(st.lists(st.floats(-5, 5), min_size=2, max_size=2), st.integers(0, 10**6))
def test_the_gradient_of_a_plane_is_exact_also_at_the_ends_of_the_box(weights, seed):
    low, high = np.array([-1.0, 0.0]), np.array([1.0, 4.0])
    actions = np.random.default_rng(seed).uniform(low, high, (2, 7, 2))
    actions[0, :2] = low, high
    value = lambda observations, actions: actions @ weights  # noqa: E731
    gradient = d.action_gradient(value, np.zeros((2, 7, 3)), actions, low, high)
    np.testing.assert_allclose(gradient, np.broadcast_to(weights * (high - low) / 2.0, gradient.shape), atol=1e-9)


def test_slices_follow_one_dimension():
    line, values = d.value_slices(theorem_1, np.array([[[0.0], [0.05]]]), LOW, HIGH, count=5)
    np.testing.assert_allclose(line, [-0.1, -0.05, 0.0, 0.05, 0.1])
    np.testing.assert_array_equal(values, [[[1, 1, 0, 0, 0], [1, 0, 0, 0, 0]]])
    with pytest.raises(InvalidOption):
        d.value_slices(theorem_1, STATES, LOW, HIGH, dimension=1)


def test_a_step_function_is_flat_and_a_plane_is_not():
    assert d.flat_share(theorem_1, STATES, ACTIONS, LOW, HIGH)[0] > 0.9
    assert d.flat_share(slanted, STATES, ACTIONS, LOW, HIGH) == 0.0


def test_the_deadlock_of_theorem_1_is_found_where_one_step_is_rewarded():
    """Of 50 states, those below 0.1 have a rewarded action; the actor of Eq. 6.3 is stuck in all of them."""
    index = d.deadlock_index(constant(0.1), theorem_1, STATES, LOW, HIGH)
    assert index == (STATES < 0.1).mean()


def test_a_solved_problem_is_no_deadlock():
    near = STATES[:, :5]
    assert d.deadlock_index(constant(-0.1), theorem_1, near, LOW, HIGH) == 0.0


def test_a_gradient_towards_better_actions_is_no_deadlock_but_a_local_maximum_at_the_end_is():
    assert d.deadlock_index(constant(0.1), slanted, STATES, LOW, HIGH) == 0.0
    valley = lambda observations, actions: np.abs(actions[..., 0] - 0.05) * np.where(actions[..., 0] < 0.05, 2, 1)  # noqa: E731
    assert d.deadlock_index(constant(0.1), valley, STATES, LOW, HIGH) == 1.0


def test_rewarded_share():
    rewards = np.array([[1.0, 0.0, -1.0, 0.0], [1.0, 1.0, 5.0, 5.0]])
    np.testing.assert_array_equal(d.rewarded_share(rewards), [0.25, 1.0])
    mask = np.array([[True, True, False, False]] * 2)
    np.testing.assert_array_equal(d.rewarded_share(rewards, mask), [0.5, 1.0])
    with pytest.raises(InvalidOption):
        d.rewarded_share(rewards, np.zeros_like(mask))


@given(st.floats(0.001, 0.1), st.floats(0.0, 0.3), st.floats(0.0, 0.95))
def test_returns_on_the_toy_are_powers_of_the_discount(step, start, discount):
    """From s, going left by `step`, the reward comes with the n-th step, n the first with s - n step < 0."""
    model = make("pbcs/Toy1D-v0")
    position, count = start, 0
    while position >= 0.0 and count < 20:
        position, count = position - step, count + 1
    expected = discount ** (count - 1) if position < 0.0 else 0.0
    returns = d.returns_of(model, constant(-step), np.full((1, 1, 1), start), np.full((1, 1, 1), -step), discount, 20)
    np.testing.assert_allclose(returns, [[expected]])


def test_the_critic_of_theorem_1_is_the_return_of_its_actor():
    model = make("pbcs/Toy1D-v0")
    states = np.tile(STATES, (2, 1, 1))
    controls = np.tile(ACTIONS, (2, 1, 1))
    stuck = d.distance_to_returns(model, constant(0.1), theorem_1, states, controls, 0.99, 30)
    np.testing.assert_array_equal(stuck, [0.0, 0.0])
    moving = d.distance_to_returns(model, constant(-0.1), theorem_1, states, controls, 0.99, 30)
    assert (moving > 0.5).all()
    with pytest.raises(InvalidOption):
        d.returns_of(model, constant(0.1), states, controls, 1.0, 30)
