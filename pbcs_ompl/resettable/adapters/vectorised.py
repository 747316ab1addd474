"""The adapter for environments that are functions of batches of states already: nothing is put in between."""

from collections.abc import Callable
from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray, Capability, Transition
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.model import Model


class VectorisedModel(Model):
    """A `VectorisedEnv` as a `ResettableModel`: its own methods, bound directly, beside `Model`'s.

    `step_one` is the environment's, if it has one: then nothing is checked in it, and NaN gives NaN.
    """

    capabilities: frozenset[Capability] = frozenset({"visited", "arbitrary", "exact"})

    def __init__(self, env: Any):
        offers = EnvAttributes.of(env)
        super().__init__(env, offers, env.state_low, env.state_high)
        self.goal_threshold = float(env.goal_threshold)
        exact = self.actions.exact  # else controls are rounded to actions first
        self.transition: Callable[[Array, Array], Transition] = env.transition if exact else self._transition_of_actions
        self.observe: Callable[[Array], Array] = env.observe
        self.goal_distance: Callable[[Array], Array] = env.goal_distance
        self.step_one: Callable[[list[float], list[float]], list[float]] = (
            (exact and offers.step_one) or self._step_one_by_transition)

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] the environment can be in [B]."""
        valid: BoolArray = self.env.is_valid(states)
        return valid

    def compiled_step(self) -> Any:
        """Return what the environment offers to compiled planners: its `compiled_step()`, or None."""
        offered = self._offers.compiled_step
        return None if offered is None or not self.actions.exact else offered()

    def _transition_of_actions(self, states: Array, controls: Array) -> Transition:
        actions = self.actions.to_actions(controls)
        outcome: Transition = self.env.transition(states, self.actions.to_controls(actions))
        return outcome

    def _step_one_by_transition(self, state: list[float], control: list[float]) -> list[float]:
        outcome = self.transition(np.array([state]), np.array([control]))
        if outcome.ended[0] and not outcome.success[0]:
            return []
        following: list[float] = outcome.states[0].tolist()
        return following
