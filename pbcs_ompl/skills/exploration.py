"""Transitions of an exploration that does not stop at the goal, as a replay buffer wants them."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.resettable.without_goal import without_goal


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
