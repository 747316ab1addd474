"""Run many episodes towards one target as one batch, with the shaped reward of [Matheron2020]."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray
from pbcs_ompl.skills.activation_sets import Target

Act = Callable[[Array], Array]
"""Controls [B, A] for states [B, D]."""


@dataclass(frozen=True)
class Episodes:
    """The transitions of a batch of episodes, in the order they were made.

    Attributes:
        reached: Which episodes reached the target [B].
        steps: The length of each episode [B].
        states, controls, rewards, next_states, terminals: The transitions, [N, ...]. A transition is terminal when
            it reached the target, or when the environment terminated; the value of what follows a truncated episode
            counts.
    """

    reached: BoolArray
    steps: IndexArray
    states: Array
    controls: Array
    rewards: Array
    next_states: Array
    terminals: BoolArray

    @property
    def success_rate(self) -> float:
        """Share of the episodes that reached the target."""
        return float(self.reached.mean())

    @property
    def transitions(self) -> int:
        """Number of environment steps that were made."""
        return len(self.states)


def run_episodes(model: ResettableModel, act: Act, target: Target, starts: Array, *, epsilon: float, max_steps: int,
                 rng: np.random.Generator, success_reward: float | None, counter: Counter) -> Episodes:
    """Run one episode from each start state with an epsilon-greedy policy.

    Args:
        model: The environment.
        act: The policy.
        target: Where an episode is a success.
        starts: States [B, D].
        epsilon: Fraction of random actions.
        max_steps: Length at which an episode ends, in steps.
        rng: Source of random actions.
        counter: Counts every transition.
        success_reward: The reward for reaching the target, of the shaped reward; None for the environment's own reward.

    Source: [Matheron2020] Alg. 8. Differs: the episodes run side by side; each ends when the target is reached, the
    environment ends it, or after `max_steps`.

    Raises:
        BudgetUsedUp: in the middle of the episodes.
    """
    states = starts.copy()
    alive = np.arange(len(starts))
    reached = np.zeros(len(starts), dtype=bool)
    steps = np.zeros(len(starts), dtype=np.int64)
    parts: list[tuple[NDArray[Any], ...]] = []
    for _ in range(max_steps):
        here = states[alive]
        controls = with_random_actions(model, act(here), epsilon, rng)
        counter.spend(len(alive))
        outcome = model.transition(here, controls)
        success = target.contains(model, outcome.states)
        ended = success | outcome.ended
        rewards = outcome.rewards
        if success_reward is not None:
            rewards = shaped_rewards(target.distance(model, here), target.distance(model, outcome.states), success,
                                     target.radius, success_reward)
        parts.append((here, controls, rewards, outcome.states, success | outcome.terminated))
        states[alive] = outcome.states
        steps[alive] += 1
        reached[alive[success]] = True
        alive = alive[~ended]
        if not len(alive):
            break
    return Episodes(reached, steps, *(np.concatenate(part) for part in zip(*parts, strict=True)))


def with_random_actions(model: ResettableModel, controls: Array, epsilon: float, rng: np.random.Generator) -> Array:
    """Replace each of the controls [B, A] by a uniformly random action with probability `epsilon`."""
    if epsilon > 0:
        chosen = np.flatnonzero(rng.random(len(controls)) < epsilon)
        controls[chosen] = rng.uniform(model.action_low, model.action_high, (len(chosen), controls.shape[1]))
    return controls


def shaped_rewards(before: Array, after: Array, reached: BoolArray, radius: float, success_reward: float) -> Array:
    """Return the shaped rewards [B]: `success_reward` where the target is reached, else Phi(s') - Phi(s).

    The potential is Phi(s) = 1 / d(s, target).

    Args:
        before, after: Distances d(s, target) and d(s', target) [B].
        reached: Whether s' lies in the target [B].
        radius: That of the target.
        success_reward: The reward for reaching the target.

    Source: [Matheron2020] section 7.2.3. Differs: d is bounded below by the target's `radius`. Outside the target this
    changes nothing for a ball; it keeps a step that leaves the target from an arbitrarily small distance finite.
    """
    gain = 1.0 / np.maximum(after, radius) - 1.0 / np.maximum(before, radius)
    return np.where(reached, success_reward, gain)
