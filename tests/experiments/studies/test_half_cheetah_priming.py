"""The policy that primes the others in the half-cheetah study is good."""

import numpy as np

from pbcs_ompl.agents import Policy
from pbcs_ompl.experiments.study import find_study
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import read_arrays

STUDY = find_study("half-cheetah-priming")


def test_the_good_policy_runs_fast_from_the_start():
    model = make("pbcs/SparseHalfCheetah-v0", {"threads": 1})
    policy = Policy.from_arrays(read_arrays(STUDY.folder / "expert.npz"))
    state, rewards = model.initial_state(0)[None], []
    for _ in range(100):
        outcome = model.transition(state, policy.act(model.observe(state)))
        state = outcome.states
        rewards.append(outcome.rewards[0])
    assert np.mean(rewards) > 1.6
