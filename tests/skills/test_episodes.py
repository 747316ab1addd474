"""Episodes that run side by side are the episodes that run one after the other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.errors import BudgetUsedUp
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.skills.activation_sets import Ball, EnvironmentGoal
from pbcs_ompl.skills.episodes import run_episodes, shaped_rewards, with_random_actions

MODEL = make("pbcs/Maze-v0", {"size": 2})
REWARD = 10.0
distances = st.lists(st.floats(0.11, 50.0), min_size=2, max_size=30)


def towards(point):
    return lambda states: np.clip(np.asarray(point) - states, -0.1, 0.1)


def starts(count, seed=0):
    return np.random.default_rng(seed).uniform(0.1, 0.9, (count, 2))


def test_a_batch_equals_single_episodes():
    target, act = Ball(np.array([0.5, 0.5]), 0.1), towards([0.5, 0.5])
    options = {"epsilon": 0.0, "max_steps": 30, "rng": np.random.default_rng(0), "success_reward": REWARD,
               "counter": Counter()}
    together = run_episodes(MODEL, act, target, starts(20), **options)
    apart = [run_episodes(MODEL, act, target, one[None], **options)
             for one in starts(20)]
    assert together.steps.tolist() == [episode.steps[0] for episode in apart]
    assert together.reached.all()
    assert together.transitions == sum(episode.transitions for episode in apart) == together.steps.sum()
    rows = {tuple(np.r_[s, a, r, n, t]) for s, a, r, n, t in zip(
        together.states, together.controls, together.rewards, together.next_states, together.terminals, strict=True)}
    assert rows == {tuple(np.r_[s, a, r, n, t]) for e in apart for s, a, r, n, t in zip(
        e.states, e.controls, e.rewards, e.next_states, e.terminals, strict=True)}


def test_transitions_are_steps_of_the_environment():
    episodes = run_episodes(MODEL, towards([1.5, 0.5]), EnvironmentGoal(0.2), starts(10), epsilon=0.5, max_steps=15,
                            rng=np.random.default_rng(1), success_reward=REWARD,
                            counter=Counter())
    np.testing.assert_array_equal(MODEL.transition(episodes.states, episodes.controls).states, episodes.next_states)


def test_only_the_last_transition_of_a_successful_episode_is_terminal():
    target = Ball(np.array([0.5, 0.5]), 0.1)
    episodes = run_episodes(MODEL, towards([0.5, 0.5]), target, np.array([[0.2, 0.2], [1.5, 1.5]]), epsilon=0.0,
                            max_steps=10, rng=np.random.default_rng(0), success_reward=REWARD,
                            counter=Counter())
    assert episodes.reached.tolist() == [True, False]
    assert episodes.terminals.sum() == 1
    assert episodes.rewards[episodes.terminals].tolist() == [REWARD]
    assert target.contains(MODEL, episodes.next_states[episodes.terminals]).all()
    assert episodes.success_rate == 0.5


def test_unshaped_rewards_are_the_environments():
    episodes = run_episodes(MODEL, towards([0.5, 1.5]), EnvironmentGoal(0.2), np.array([[0.5, 1.2]]), epsilon=0.0,
                            max_steps=10, rng=np.random.default_rng(0), success_reward=None,
                            counter=Counter())
    assert episodes.rewards.tolist() == [1.0]


@pytest.mark.parametrize("epsilon", [0.0, 0.1, 0.5, 1.0])
def test_a_share_epsilon_of_the_actions_is_random_and_in_the_box(epsilon):
    controls = with_random_actions(MODEL, np.full((20_000, 2), 0.05), epsilon, np.random.default_rng(0))
    changed = (controls != 0.05).any(axis=1)
    assert abs(changed.mean() - epsilon) < 0.02
    assert (np.abs(controls) <= 0.1).all()


def test_shaped_rewards_computed_by_hand():
    before = np.array([1.0, 0.5, 2.0, 0.05])
    after = np.array([0.5, 1.0, 0.1, 1.0])
    reached = np.array([False, False, True, False])
    # 1/0.5 - 1/1 = 1; 1/1 - 1/0.5 = -1; reached: 10; 1/1 - 1/0.1 = -9 (0.05 is bounded below by the radius 0.1)
    np.testing.assert_allclose(shaped_rewards(before, after, reached, 0.1, REWARD), [1.0, -1.0, REWARD, -9.0])


@given(distances)
def test_a_path_earns_the_difference_of_potentials_of_its_ends(along):
    """Ng et al. 1999: a potential cannot be collected by going round in circles."""
    before, after = np.array(along[:-1]), np.array(along[1:])
    total = shaped_rewards(before, after, np.zeros(len(before), bool), 0.1, REWARD).sum()
    np.testing.assert_allclose(total, 1 / along[-1] - 1 / along[0], atol=1e-9)


@given(distances)
def test_no_step_outside_the_goal_is_worth_as_much_as_reaching_it(along):
    before, after = np.array(along[:-1]), np.array(along[1:])
    assert (shaped_rewards(before, after, np.zeros(len(before), bool), 0.1, REWARD) < REWARD).all()


def test_a_budget_binds_to_the_transition():
    counter = Counter(33)
    with pytest.raises(BudgetUsedUp):
        run_episodes(MODEL, towards([1.5, 0.5]), EnvironmentGoal(0.2), starts(10), epsilon=0.5, max_steps=15,
                     rng=np.random.default_rng(1), success_reward=REWARD, counter=counter)
    assert 0 <= counter.left < 10
