"""The methods of chapter 4: what fills the replay buffer, and who makes steps afterwards."""

import numpy as np
import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption, TrainingStalled
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.skills import train
from pbcs_ompl.skills.config import TrainConfig
from pbcs_ompl.skills.exploration import explore, without_goal
from pbcs_ompl.skills.learner import Learner
from pbcs_ompl.skills.milestones import Milestones
from pbcs_ompl.skills.offline import Bootstrapped, Offline

MODEL = make("pbcs/Maze-v0", {"size": 2, "wall_penalty": -1.0})


def learner(method, **settings):
    quick = {"explored": 500, "beta": 4, "relative_observations": False}
    config = TrainConfig(method=method, settings=quick | settings)
    start = MODEL.initial_state(0)
    milestones = Milestones(np.stack([start, start]), MODEL, config.skill_settings())
    return Learner(config.agent_factory(MODEL), milestones, Counter(100_000), np.random.default_rng(0))


def test_an_exploration_goes_on_beyond_the_goal_and_is_true():
    found = explore(MODEL, 10_000, seed=0)
    outcome = MODEL.transition(found.states, found.controls)
    np.testing.assert_array_equal(found.next_states, outcome.states)
    np.testing.assert_array_equal(found.rewards, outcome.rewards)
    assert len(found.rewards) == 10_000
    assert found.terminals.sum() > 1
    assert set(np.unique(found.rewards)) == {-1.0, 0.0, 1.0}
    np.testing.assert_array_equal(found.terminals, found.rewards == 1.0)
    assert not (MODEL.goal_distance(found.states) < MODEL.goal_threshold).any()


def test_an_exploration_is_alg_5_one_node_at_a_time():
    """Every node is selected after all nodes before it were inserted, as with batch=1."""
    model = without_goal(MODEL)
    tree = plan(model, "Ex", planner_kwargs={"batch": 1}, seed=3, max_transitions=2000).tree
    found = explore(MODEL, 2000, seed=3)
    np.testing.assert_array_equal(found.next_states, tree.states[1:])
    batched = plan(model, "Ex", seed=3, max_transitions=2000).tree
    assert not np.array_equal(batched.states, tree.states)


def test_explorations_repeat_themselves_and_differ_by_seed():
    first, again, other = (explore(MODEL, 200, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.next_states, again.next_states)
    assert not np.array_equal(first.next_states, other.next_states)


def test_bootstrapped_fills_then_adds_its_own_steps():
    method = Bootstrapped(learner("bootstrapped"))
    method.step()
    assert (method.learner.agent.replay_sizes[0], method.learner.counter.count) == (500, 500)
    assert method.learner.updates == 0
    method.step()
    assert method.learner.agent.replay_sizes[0] == method.learner.counter.count > 500
    assert method.learner.updates > 0


def test_offline_keeps_the_buffer_as_it_is():
    method = Offline(learner("offline", updates_per_transition=0.5))
    for _ in range(3):
        method.step()
    assert method.learner.agent.replay_sizes[0] == 500
    assert method.learner.updates == 4 * 50 * 0.5
    assert method.learner.counter.count > 500  # the steps of the test


def test_the_exploration_is_part_of_the_budget():
    with pytest.raises(TrainingStalled) as stalled:
        train("pbcs/Maze-v0", env_kwargs={"size": 2}, method="offline", max_transitions=300, seed=0)
    assert stalled.value.result.train_transitions == 300
    with pytest.raises(InvalidOption, match="explored"):
        train("pbcs/Maze-v0", method="offline", settings={"explored": 0})
