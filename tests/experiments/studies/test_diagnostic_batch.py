"""Stacks are joined seed by seed; observers ask all agents at the same states outside of the goal."""

import numpy as np
import pytest

from pbcs_ompl.agents import DDPG, DDPGSettings
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.experiments.diagnostic_batch import DiagnosticBatch, sample_states
from pbcs_ompl.experiments.stacked_training import chunks
from pbcs_ompl.experiments.training_curves import joined_first_rewards, joined_observed, joined_success
from pbcs_ompl.resettable import make

RECORDS = [{"success": [[0, 1], [0, 1], [1, 1]], "first_reward": [30, 2], "observed": {"x": [[0, 0], [1, 2]]}},
           {"success": [[1], [1]], "first_reward": [-1], "observed": {"x": [[0], [3]]}}]


def test_chunks_hold_every_seed_once():
    assert list(chunks(7, 3)) == [[0, 1, 2], [3, 4, 5], [6]]


def test_a_stack_that_ended_early_stays_solved():
    steps, success = joined_success(RECORDS, 30, 10)
    np.testing.assert_array_equal(steps, [0, 10, 20, 30])
    np.testing.assert_array_equal(success, np.array([[0, 1, 1], [0, 1, 1], [1, 1, 1], [1, 1, 1]]) > 0)
    np.testing.assert_array_equal(joined_first_rewards(RECORDS), [30, 2, -1])
    np.testing.assert_array_equal(joined_observed(RECORDS, "x"), [1, 2, 3])


@pytest.mark.parametrize("env", ["pbcs/Toy1D-v0", "pbcs/Drift-v0", "pbcs/Maze-v0"])
def test_sampled_states_are_valid_and_not_in_the_goal(env):
    model = make(env)
    states = sample_states(model, 300)
    assert len(states) == 300
    assert model.is_valid(states).all()
    assert (model.goal_distance(states) >= model.goal_threshold).all()


def test_an_environment_without_free_states_is_named():
    model = make("pbcs/Maze-v0")
    model.is_valid = lambda states: np.zeros(len(states), dtype=bool)
    with pytest.raises(InvalidState, match="0 valid states"):
        sample_states(model, 5)


def test_observers_give_each_seed_what_it_gets_alone():
    model = make("pbcs/Toy1D-v0")

    def observed(seeds):
        agent = DDPG(1, model.action_low, model.action_high, seeds=seeds, settings=DDPGSettings(hidden=(8, 8)))
        return {name: observer(agent) for name, observer in DiagnosticBatch(model).observers().items()}

    together, alone = observed((1, 2)), observed((2,))
    for name, values in together.items():
        assert values.shape == (2,)
        np.testing.assert_allclose(values[1:], alone[name], rtol=1e-4)
