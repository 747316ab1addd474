"""The types of the toolkit: arrays, transitions, the counter of transitions.

Axes: B batch, N nodes, T time, D state, A action, O observation, F feature. All arrays are float64 unless said
otherwise.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.errors import BudgetUsedUp

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.int64]
Capability = Literal["visited", "arbitrary", "exact"]
ProgressCallback = Callable[[dict[str, Any]], None]
"""Called now and then with plain numbers; must be quick and must not raise."""


class Transition(NamedTuple):
    """The outcome of one step of a batch of states."""

    states: Array
    """Next states [B, D]."""
    rewards: Array
    """Rewards [B]."""
    terminated: BoolArray
    """Whether the environment terminates in the next state [B]: what follows has no value."""
    success: BoolArray
    """Whether the next state reaches the environment's goal [B]."""
    truncated: BoolArray | None = None
    """Whether the environment itself cuts the episode off in the next state [B]; None where it never does."""

    @property
    def ended(self) -> BoolArray:
        """Whether the episode is over in the next state [B], for whatever reason. Such a state has no successors."""
        return self.terminated if self.truncated is None else self.terminated | self.truncated


class Solution(NamedTuple):
    """A path to the goal that a search has found."""

    transitions: int
    """Those of the search until then."""
    seconds: float
    """Since the search began."""
    steps: int
    """Of the path."""


class Counter:
    """Counts transitions against a budget, in one place for all planners.

    Args:
        budget: The most transitions that may be made; None for no bound.
    """

    def __init__(self, budget: int | None = None):
        self.count = 0
        self.budget = budget

    def spend(self, transitions: int) -> None:
        """Count transitions that are about to be made.

        Raises:
            BudgetUsedUp: fewer are left; none of them is counted.
        """
        if transitions > self.left:
            raise BudgetUsedUp(f"{transitions} transitions, but only {self.left} are left of {self.budget}")
        self.count += transitions

    @property
    def left(self) -> int:
        """Transitions that may still be made."""
        return 2**62 if self.budget is None else max(0, self.budget - self.count)
