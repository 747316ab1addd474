"""A policy as plain arrays: equal to the actor, immutable, and back from its arrays."""

import numpy as np
import pytest

from pbcs_ompl.agents import DDPG, DDPGSettings, Policy
from pbcs_ompl.agents.policy import PolicyStack
from pbcs_ompl.core.errors import DamagedFile


def make(layer_norm: bool = False) -> DDPG:
    settings = DDPGSettings(hidden=(24, 16), layer_norm=layer_norm)
    return DDPG(3, [-1.0, 0.0], [0.5, 10.0], settings=settings, seeds=(1, 2))


@pytest.mark.parametrize("layer_norm", [False, True])
def test_policy_equals_the_actor_and_its_arrays(layer_norm: bool) -> None:
    agent = make(layer_norm)
    observations = np.random.default_rng(0).normal(size=(2, 40, 3))
    for seed in range(2):
        policy = agent.policy(seed)
        again = Policy.from_arrays(policy.to_arrays())
        actions = policy.act(observations[seed])
        np.testing.assert_allclose(actions, agent.act(observations)[seed], atol=1e-5)
        assert np.array_equal(actions, again.act(observations[seed]))


@pytest.mark.parametrize("layer_norm", [False, True])
def test_a_stack_of_policies_acts_as_each_does(layer_norm: bool) -> None:
    agent, rng = make(layer_norm), np.random.default_rng(1)
    policies = [agent.policy(0), agent.policy(1), agent.policy(0)]
    observations, chosen = rng.normal(size=(60, 3)), rng.integers(0, 3, 60)
    actions = PolicyStack(policies).act(observations, chosen)
    for index, policy in enumerate(policies):
        mine = chosen == index
        np.testing.assert_array_equal(actions[mine], policy.act(observations[mine]))


def test_policy_does_not_change_with_the_agent() -> None:
    agent = make()
    rng = np.random.default_rng(0)
    policy, observations = agent.policy(), rng.normal(size=(5, 3))
    before = policy.act(observations)
    agent.add_transitions(rng.normal(size=(2, 50, 3)), rng.random((2, 50, 2)), rng.random((2, 50)),
                   rng.normal(size=(2, 50, 3)), np.zeros((2, 50)))
    agent.train(20)
    assert np.array_equal(policy.act(observations), before)
    assert not np.array_equal(agent.policy().act(observations), before)
    with pytest.raises(ValueError, match="read-only"):
        policy.layers[0][0][0, 0] = 1.0


@pytest.mark.parametrize("damage", [
    lambda arrays: arrays.pop("bias_1"),
    lambda arrays: arrays.pop("low"),
    lambda arrays: arrays.update(weight_1=np.zeros((3, 3))),
    lambda arrays: arrays.update(high=np.zeros(5)),
    lambda arrays: arrays.update(bias_0=np.full_like(arrays["bias_0"], np.nan)),
    lambda arrays: arrays.clear(),
])
def test_damaged_arrays_are_refused(damage) -> None:
    arrays = make().policy().to_arrays()
    damage(arrays)
    with pytest.raises(DamagedFile, match="policy"):
        Policy.from_arrays(arrays)
