"""The methods of [Matheron2020] chapter 4: how the replay buffer is filled, and which steps follow."""

import numpy as np
import pytest

from pbcs_ompl.agents import DDPG, DDPGSettings
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.skills import method_settings, train
from pbcs_ompl.skills.exploration import explore, without_goal
from pbcs_ompl.skills.single_policy import Bootstrapped, Offline
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

MODEL = make("pbcs/Maze-v0", {"size": 2, "wall_penalty": -1.0})


def build(method, name, **changes):
    """The method, with few episodes and a short exploration."""
    settings = method_settings(name, "fast", {"prefill_transitions": 500, "beta": 4} | changes)

    def agent(seed):
        return DDPG(MODEL.observation_size, MODEL.action_low, MODEL.action_high, seeds=(seed,),
                    settings=DDPGSettings.from_preset("fast"))

    waypoints = Waypoints.at_start(0, MODEL, settings.starts)
    trainer = SkillTrainer(agent, waypoints, settings.episodes, Counter(100_000), np.random.default_rng(0))
    return method(trainer, settings)


def test_an_exploration_continues_beyond_the_goal_and_is_true():
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
    method = build(Bootstrapped, "bootstrapped")
    method.step()
    assert (method.trainer.agent.replay_sizes[0], method.trainer.counter.count) == (500, 500)
    assert method.trainer.updates == 0
    method.step()
    assert method.trainer.agent.replay_sizes[0] == method.trainer.counter.count > 500
    assert method.trainer.updates > 0


def test_offline_keeps_the_buffer_as_it_is():
    method = build(Offline, "offline", updates_per_transition=0.5)
    for _ in range(3):
        method.step()
    assert method.trainer.agent.replay_sizes[0] == 500
    assert method.trainer.updates == 4 * 50 * 0.5
    assert method.trainer.counter.count > 500  # the steps of the test


def test_the_exploration_is_part_of_the_budget():
    result = train("pbcs/Maze-v0", env_kwargs={"size": 2}, method="offline", max_transitions=300, seed=0)
    assert result.train_transitions == 300
    with pytest.raises(InvalidOption, match="prefill_transitions"):
        train("pbcs/Maze-v0", method="offline", settings={"prefill_transitions": 0})
