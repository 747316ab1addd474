"""Diagnostics that a stacked training records at each evaluation, on the same random states every time."""

import numpy as np

from pbcs_ompl import diagnostics
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.experiments.stacked_training import Observer

ROUNDS = 100


def sample_states(model: ResettableModel, count: int, seed: int = 0) -> Array:
    """Return valid states [count, D], uniform within the bounds but for the goal.

    Raises:
        InvalidState: hardly any state is valid.
    """
    rng, found = np.random.default_rng(seed), np.empty((0, len(model.state_low)))
    for _ in range(ROUNDS):
        drawn = rng.uniform(model.state_low, model.state_high, (count, len(model.state_low)))
        good = model.is_valid(drawn) & (model.goal_distance(drawn) >= model.goal_threshold)
        found = np.concatenate([found, drawn[good]])
        if len(found) >= count:
            return found[:count]
    raise InvalidState(f"{model.spec.id}: {len(found)} valid states in {ROUNDS * count} draws, expected {count}")


class DiagnosticBatch:
    """Random states and actions at which the agents of a stack are evaluated.

    Args:
        count: How many states, each with one action.
    """

    def __init__(self, model: ResettableModel, count: int = 50):
        self.model, self.low, self.high = model, model.action_low, model.action_high
        self.states = sample_states(model, count)
        self.actions = np.random.default_rng(1).uniform(self.low, self.high, (count, len(self.low)))
        self.observations = model.observe(self.states)

    def observers(self) -> dict[str, Observer]:
        """Return the diagnostics that cost little, by name."""
        return {"saturation": self.saturation, "flat_share": self.flat_share, "deadlock_index": self.deadlock_index,
                "largest_value": self.largest_value, "largest_action": self.largest_action}

    def saturation(self, agent: StackedAgent) -> Array:
        """Return the share of actions at an end of the box [S]."""
        return diagnostics.saturation(agent.act, _of_all(agent, self.observations), self.low, self.high)

    def flat_share(self, agent: StackedAgent) -> Array:
        """Return the share of pairs (s, a) where the critic is flat along the actions [S]."""
        return diagnostics.flat_share(agent.value, _of_all(agent, self.observations), _of_all(agent, self.actions),
                                      self.low, self.high)

    def deadlock_index(self, agent: StackedAgent) -> Array:
        """Return the share of states where the actor is stuck [S]."""
        return diagnostics.deadlock_index(agent.act, agent.value, _of_all(agent, self.observations), self.low,
                                          self.high)

    def largest_value(self, agent: StackedAgent) -> Array:
        """Return max |Q| [S]."""
        return diagnostics.largest_values(agent.value, _of_all(agent, self.observations), _of_all(agent, self.actions))

    def largest_action(self, agent: StackedAgent) -> Array:
        """Return max |pi| [S]."""
        return diagnostics.largest_actions(agent.act, _of_all(agent, self.observations))

    def mean_action(self, agent: StackedAgent) -> Array:
        """Return the mean of the first component of pi [S]."""
        first: Array = agent.act(_of_all(agent, self.observations))[..., 0].mean(axis=1)
        return first

    def distance_to_returns(self, agent: StackedAgent, discount: float, horizon: int) -> Array:
        """Return the mean of |Q - Q^pi| [S]."""
        return diagnostics.distance_to_returns(self.model, agent.act, agent.value, _of_all(agent, self.states),
                                               _of_all(agent, self.actions), discount, horizon)


def _of_all(agent: StackedAgent, values: Array) -> Array:
    """Return the same values [B, ...] for each agent of the stack [S, B, ...]."""
    return np.repeat(values[None], len(agent.seeds), axis=0)
