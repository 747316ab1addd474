"""Train the good policy that primes the others: `python pretrain.py [SEED]` writes expert.npz beside this file.

TD3 learns from the speed itself, as in Gymnasium's HalfCheetah-v5, until the policy without noise has returns above
1950 of 2000 in the sparse task from each of ten starts, as [Matheron2020] 6.7 asks.
"""

import sys
from pathlib import Path

import numpy as np

from pbcs_ompl.agents import TD3, Policy, TD3Settings
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import write_arrays

EXPERT = Path(__file__).with_name("expert.npz")
EPISODE, EPISODES, WARM_UP, BLOCK = 1000, 500, 10, 50
CONTROL_COST, SIGMA, GOOD = 0.1, 0.1, 1950.0
STARTS = 10
X = 1
STEP_SECONDS = 0.05
"""The time of one step of HalfCheetah."""


def returns(model: ResettableModel, policy: Policy, starts: Array) -> Array:
    """Return the sparse returns [B] of a policy without noise, one episode from each start [B, D]."""
    states, total = starts.copy(), np.zeros(len(starts))
    for _ in range(EPISODE):
        outcome = model.transition(states, policy.act(model.observe(states)))
        states, total = outcome.states, total + outcome.rewards
    return total


def main(seed: int) -> None:
    """Train, and stop at the first policy that is good enough."""
    model, rng = make("pbcs/SparseHalfCheetah-v0", {"threads": 1}), np.random.default_rng(seed)
    low, high = model.action_low, model.action_high
    agent = TD3(model.observation_size, low, high, seeds=(seed,), settings=TD3Settings(
        hidden=(128, 128), discount=0.99, batch_size=128))
    starts = np.array([model.initial_state(index) for index in range(STARTS)])
    for episode in range(EPISODES):
        state = model.initial_state(seed + episode)[None]
        for _ in range(EPISODE // BLOCK):
            rows = []
            for _ in range(BLOCK):
                observation = model.observe(state)
                noise = SIGMA * rng.standard_normal(low.shape)
                action = (rng.uniform(low, high)[None] if episode < WARM_UP else
                          np.clip(agent.act(observation[None])[0] + noise, low, high))
                after = model.transition(state, action).states
                reward = (after[:, X] - state[:, X]) / STEP_SECONDS - CONTROL_COST * np.square(action).sum(axis=1)
                rows.append((observation, action, reward, model.observe(after)))
                state = after
            observations, actions, rewards, following = (np.stack(part, axis=1) for part in zip(*rows, strict=True))
            agent.add_transitions(observations, actions, rewards, following, np.zeros((1, BLOCK), dtype=np.bool_))
            if episode >= WARM_UP:
                agent.train(BLOCK)
        if episode % 10 == 9:
            found = returns(model, agent.policy(), starts)
            print(f"{episode + 1} episodes: sparse return {found.mean():.0f}, from {found.min():.0f}", flush=True)
            if found.min() > GOOD:
                write_arrays(EXPERT, **agent.policy().to_arrays())
                return
    sys.exit(f"not good enough after {EPISODES} episodes; try another seed")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
