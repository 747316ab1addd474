"""An environment in which a planner explores on, whether or not it comes past the goal."""

from typing import cast

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Transition


def without_goal(model: ResettableModel) -> ResettableModel:
    """Return an environment whose goal is not to be found, for a planner that would stop there.

    Terminal states stay terminal. There is no compiled step: that of the environment knows the goal.
    """
    return cast(ResettableModel, _WithoutGoal(model))


class _WithoutGoal:
    def __init__(self, model: ResettableModel):
        self._model = model
        for name in ResettableModel.__annotations__:
            setattr(self, name, getattr(model, name))
        self.initial_state, self.step_one, self.observe = model.initial_state, model.step_one, model.observe
        self.feature, self.is_valid, self.distance = model.feature, model.is_valid, model.distance
        self.perturb, self.advance_towards = model.perturb, model.advance_towards

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, D] by one step under controls [B, A]; none of them is a success."""
        outcome = self._model.transition(states, controls)
        return outcome._replace(success=np.zeros(len(states), dtype=np.bool_))

    def goal_distance(self, states: Array) -> Array:
        """Return infinite distances [B]."""
        return np.full(len(states), np.inf)
