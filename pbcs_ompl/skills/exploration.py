"""Transitions of an exploration that does not stop at the goal, as a replay buffer wants them."""

from dataclasses import dataclass
from typing import cast

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Transition


@dataclass(frozen=True)
class Transitions:
    """States [N, D], controls [N, A], rewards [N], next states [N, D], terminals [N], in the order they were made."""

    states: Array
    controls: Array
    rewards: Array
    next_states: Array
    terminals: BoolArray


def explore(model: ResettableModel, count: int, seed: int) -> Transitions:
    """Explore `count` transitions with Ex (Alg. 5, one node at a time), whether or not the goal is found on the way.

    Rewards are the environment's own. A transition is terminal as those of `Episodes` are.

    Source: [Matheron2020] 4.2, Fig. 4.3, and 4.4.

    Raises:
        InvalidOption: fewer than one transition.
    """
    if count < 1:
        raise InvalidOption(f"an exploration of {count} transitions, expected at least 1")
    tree = plan(without_goal(model), "Ex", planner_kwargs={"batch": 1}, seed=seed, max_transitions=count).tree
    children = np.flatnonzero(tree.parents >= 0)
    states, controls = tree.states[tree.parents[children]], tree.controls[children]
    outcome = model.transition(states, controls)  # a tree has no rewards: ask again, it is the same answer
    return Transitions(states, controls, outcome.rewards, outcome.states, outcome.terminated | outcome.success)


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
