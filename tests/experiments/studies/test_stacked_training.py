"""A stack of seeds does what its seeds do alone; the counts and ends of episodes are those of the environment."""

import numpy as np
import pytest

from pbcs_ompl.agents import DDPG, DDPGSettings
from pbcs_ompl.agents.noise import make_noise
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.stacked_training import NEVER, LoopSettings, StackedTraining, solved
from pbcs_ompl.resettable import make

TOY = make("pbcs/Toy1D-v0")
SMALL = DDPGSettings(hidden=(8, 8), batch_size=10)


def training(seeds, noise="epsilon-greedy", model=TOY, expert=None, observers=None, **changes):
    settings = LoopSettings(**{"steps": 200, "evaluate_every": 100, **changes})
    agent = DDPG(model.observation_size, model.action_low, model.action_high, settings=SMALL, seeds=seeds,
                 compile=False)
    return StackedTraining(model, agent, make_noise(noise), settings, expert=expert, observers=observers)


@pytest.mark.parametrize("noise", ["epsilon-greedy", "ornstein-uhlenbeck"])
@pytest.mark.parametrize("copies", [1, 3])
def test_a_stack_is_its_seeds_alone(noise, copies):
    observers = {"action": lambda agent: agent.act(np.zeros((len(agent.seeds), 1, 1)))[:, 0, 0]}
    together = training((3, 4, 5), noise, copies=copies, observers=observers).run()
    for index, seed in enumerate((3, 4, 5)):
        alone = training((seed,), noise, copies=copies, observers=observers).run()
        assert alone.first_reward[0] == together.first_reward[index]
        np.testing.assert_array_equal(np.array(alone.rewarded)[:, 0], np.array(together.rewarded)[:, index])
        np.testing.assert_allclose(np.array(alone.observed["action"])[:, 0],
                                   np.array(together.observed["action"])[:, index], atol=1e-6)


def test_an_expert_finds_the_reward_with_every_step_and_its_episodes_end_there():
    run = training((0, 1), expert=lambda states: np.full_like(states, -0.1))
    curves = run.run()
    assert curves.steps == [0, 100, 200]
    np.testing.assert_array_equal(curves.first_reward, [1, 1])
    np.testing.assert_array_equal(curves.rewarded[-1], [1.0, 1.0])
    assert (run._states == 0.0).all()


def test_the_expert_acts_from_its_step_on():
    curves = training((0,), "ornstein-uhlenbeck", model=make("pbcs/Drift-v0"), expert=lambda states: states * 0.0 - 1.0,
                      expert_after=100).run()
    np.testing.assert_array_equal(curves.first_reward, [NEVER])
    assert curves.ended == 200


@pytest.mark.parametrize("noise", ["epsilon-greedy", "ornstein-uhlenbeck"])
def test_a_seed_does_the_same_in_a_stack_that_others_leave(noise):
    observers = {"action": lambda agent: agent.act(np.zeros((len(agent.seeds), 1, 1)))[:, 0, 0]}
    together, leaving = (training(tuple(range(10)), noise, steps=1000, patience=patience, copies=2,
                                  observers=observers) for patience in (0, 2))
    full, curves = together.run(), leaving.run()
    assert (full.solved_at == NEVER).all()
    assert len(set(curves.solved_at.tolist())) > 2, "the case needs seeds that leave one after the other"
    np.testing.assert_array_equal(leaving.active, np.flatnonzero(curves.solved_at == NEVER))
    np.testing.assert_array_equal(curves.first_reward, full.first_reward)
    for index, left in enumerate(curves.solved_at):
        rows = [row for row, step in enumerate(full.steps) if left == NEVER or step <= left]
        for name in ("success", "rewarded"):
            np.testing.assert_array_equal(np.array(getattr(curves, name))[rows, index],
                                          np.array(getattr(full, name))[rows, index])
        np.testing.assert_allclose(np.array(curves.observed["action"])[rows, index],
                                   np.array(full.observed["action"])[rows, index], atol=1e-6)
        if left != NEVER:
            assert np.array(curves.success)[rows[-1] - 1:, index].all()


def test_a_solved_stack_ends_early():
    always = training((0, 1), steps=5000, patience=2, expert=lambda states: np.full_like(states, -0.1))
    curves = always.run()
    assert curves.ended < 5000
    assert np.array(curves.success)[-2:].all()
    assert curves.solved_at.max() == curves.ended


def test_solved_is_what_the_policy_does():
    class Left:
        def act(self, observations):
            return np.where(observations < 0.5, -0.03, 0.1)

    np.testing.assert_array_equal(solved(TOY, Left(), np.array([[0.0], [0.2], [0.6]]), 8), [True, True, False])
    np.testing.assert_array_equal(solved(TOY, Left(), np.array([[0.0], [0.2], [0.6]]), 6), [True, False, False])


def test_summary_is_plain():
    import json

    summary = training((0, 1)).run().summary()
    assert json.loads(json.dumps(summary)) == summary
    assert summary["ended"] == 200


@pytest.mark.parametrize("changes", [{"steps": 0}, {"steps": 130}, {"evaluate_every": 75}, {"patience": -1}])
def test_bad_settings(changes):
    with pytest.raises(InvalidOption):
        training((0,), **changes)
