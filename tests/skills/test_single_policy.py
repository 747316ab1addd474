"""The methods of [Matheron2020] chapter 4: how the replay buffer is filled, and which steps follow."""

import numpy as np
import pytest

from pbcs_ompl.agents import DDPG, DDPGSettings
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.without_goal import without_goal
from pbcs_ompl.skills import method_settings, train
from pbcs_ompl.skills.exploration import explore
from pbcs_ompl.skills.single_policy import PB, Bootstrapped, Offline, Plain
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

MODEL = make("pbcs/Maze-v0", {"size": 2, "wall_penalty": -1.0})


def build(method, name, **changes):
    """The method, with few episodes and a short exploration."""
    prefill = {"prefill_transitions": 500} if issubclass(method, Bootstrapped) else {}
    settings = method_settings(name, "fast", prefill | {"beta": 4} | changes)

    def agent(seed, horizon=1.0):
        return DDPG(MODEL.observation_size, MODEL.action_low, MODEL.action_high, seeds=(seed,),
                    settings=DDPGSettings.from_preset("fast"))

    planned = np.linspace([0.5, 0.5], [0.6, 0.5], 31)
    waypoints = Waypoints.at_start(0, MODEL, settings.starts) if method in (Plain, Bootstrapped, Offline) else (
        Waypoints.of_plan(planned, MODEL, settings))
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
    method = build(Offline, "offline", updates_per_transition=0.1)
    for _ in range(3):
        method.step()
    assert method.trainer.agent.replay_sizes[0] == 500
    assert method.trainer.updates == 4 * MODEL.max_episode_steps * 0.1
    assert method.trainer.counter.count > 500  # the steps of the test


def test_the_exploration_is_part_of_the_budget():
    result = train("pbcs/Maze-v0", env_kwargs={"size": 2}, method="offline", max_transitions=300, seed=0)
    assert result.train_transitions == 300
    with pytest.raises(InvalidOption, match="prefill_transitions"):
        train("pbcs/Maze-v0", method="offline", settings={"prefill_transitions": 0})


def starts_of(trainer, run):
    """The states in which the episodes of a test or a session begin."""
    begun, draw = [], trainer.waypoints.draw_starts

    def drawn(*arguments):
        begun.append(draw(*arguments))
        return begun[-1]

    object.__setattr__(trainer.waypoints, "draw_starts", drawn)
    run()
    return np.concatenate(begun)


@pytest.mark.parametrize(("method", "name", "index"), [(PB, "pb", 12), (Plain, "plain", 0)])
def test_exact_starts_are_the_waypoint_and_others_fill_its_ball(method, name, index):
    short = {"max_steps": 2} | ({"remove_loops": False, "steps_per_waypoint": 0.0} if method is PB else {})
    exact, ball = (build(method, name, exact=way, beta=200, **short).trainer for way in (True, False))
    place = exact.waypoints.states[index]
    assert (starts_of(exact, lambda: exact.session_from(np.full(200, index))) == place).all()
    spread = np.linalg.norm(starts_of(ball, lambda: ball.session_from(np.full(200, index))) - place, axis=1)
    assert 0.08 < spread.max() <= 0.1
    assert (np.linalg.norm(exact.waypoints.draw_near(np.full(9, index), exact.rng) - place, axis=1) > 0.0).all()


def test_a_test_whose_episodes_would_all_be_the_same_is_one_episode():
    once, often, noisy = (build(PB, "pb", exact=exact, test_epsilon=epsilon).trainer
                          for exact, epsilon in ((True, 0.0), (False, 0.0), (True, 0.1)))
    assert [len(starts_of(trainer, lambda trainer=trainer: trainer.test(0))) for trainer in (once, often, noisy)] == [
        1, 4, 4]


def test_the_thesis_starts_exactly_in_chapters_4_and_5_and_in_balls_in_chapter_7():
    exact = {name: method_settings(name, "thesis").starts.exact
             for name in ("pb", "backplay", "plain", "bootstrapped", "offline", "pbcs")}
    assert exact == dict.fromkeys(exact, True) | {"pbcs": False}


@pytest.mark.parametrize("preset", ["thesis", "fast"])
def test_episodes_of_one_policy_may_be_as_long_as_the_way_needs(preset):
    """An episode along the plan has two steps for each of its waypoints, up to the environment's limit."""
    factor = method_settings("pb", preset).episodes.steps_per_waypoint
    planned = build(PB, "pb", steps_per_waypoint=factor, remove_loops=False).trainer
    assert (factor, planned.limit(30), planned.limit(3), planned.limit(0)) == (2.0, 50, 54, 60)
    planned.model.max_episode_steps = 55
    assert planned.limit(0) == 55
    planned.model.max_episode_steps = 100
    assert method_settings("plain", preset).episodes.max_steps == 0
    assert build(Plain, "plain").trainer.limit(0) == MODEL.max_episode_steps
    assert build(Plain, "plain", max_steps=7).trainer.limit(0) == 7


def test_a_budget_that_ends_with_nothing_names_what_stood_in_the_way():
    result = train("pbcs/Maze-v0", env_kwargs={"size": 2}, method="plain", max_transitions=5000, seed=0)
    assert "no policy that passes its test: from its waypoint 0, 1 from the goal, 0%" in result.reason
    assert "of at most 100 steps" in result.reason
    backwards = train("pbcs/Maze-v0", env_kwargs={"size": 2}, method="pb", max_transitions=5000, seed=0)
    assert "of the plan covered; from its waypoint" in backwards.reason
