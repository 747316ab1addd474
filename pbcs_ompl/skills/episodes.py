"""Run many episodes towards one goal as one batch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.skills.goals import Goal
from pbcs_ompl.skills.shaping import shaped_rewards

Act = Callable[[Array], Array]
"""Controls [B, A] for states [B, D]."""


@dataclass(frozen=True)
class Episodes:
    """The transitions of a batch of episodes, in the order they were made.

    Attributes:
        reached: Which episodes reached the goal [B].
        steps: The length of each episode [B].
        states, controls, rewards, next_states, terminals: The transitions, [N, ...]. A transition is terminal when
            it reached the goal, even when that goal is local to a skill, or when the environment ended the episode.
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
        """Share of the episodes that reached the goal."""
        return float(self.reached.mean())

    @property
    def transitions(self) -> int:
        """Number of environment steps that were made."""
        return len(self.states)


def run_episodes(model: ResettableModel, act: Act, goal: Goal, starts: Array, *, epsilon: float, max_steps: int,
                 rng: np.random.Generator, shaped: bool = True) -> Episodes:
    """Run one episode from each of `starts` [B, D] with an epsilon-greedy policy.

    Source: [Matheron2020] Alg. 8. Differs: the episodes run side by side; each ends when its goal is reached, the
    environment terminates, or after `max_steps`.
    """
    states = starts.copy()
    alive = np.arange(len(starts))
    reached = np.zeros(len(starts), dtype=bool)
    steps = np.zeros(len(starts), dtype=np.int64)
    parts: list[tuple[NDArray[Any], ...]] = []
    for _ in range(max_steps):
        here = states[alive]
        controls = with_random_actions(model, act(here), epsilon, rng)
        outcome = model.transition(here, controls)
        arrived = goal.contains(model, outcome.states)
        ended = arrived | outcome.terminated
        rewards = outcome.rewards
        if shaped:
            rewards = shaped_rewards(goal.distance(model, here), goal.distance(model, outcome.states), arrived,
                                     goal.radius)
        parts.append((here, controls, rewards, outcome.states, ended))
        states[alive] = outcome.states
        steps[alive] += 1
        reached[alive[arrived]] = True
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
