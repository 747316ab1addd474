"""What differs between planners: which nodes to expand next, with which controls."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.options import check_names, keywords
from pbcs_ompl.planners.tree import Tree

SHELL_OPTIONS = ("batch", "hold")
"""The options that every planner has beside those of its strategy."""


@dataclass(frozen=True, eq=False)
class Space:
    """What a strategy may know of the problem.

    Attributes:
        feature_low, feature_high: Bounds of the explored feature [F]; infinite where there are none.
        bin_size: Suggested edge length of bins [F].
        action_low, action_high: Bounds of the controls [A].
        episode_steps: Suggested length of an episode.
        parallel_batch: How many nodes have to be expanded together to keep all cores busy; 1 where it does not matter.
        steer: Returns controls [B, A] that lead from states [B, D] towards features [B, F]; None if nobody
            can.
    """

    feature_low: Array
    feature_high: Array
    bin_size: Array
    action_low: Array
    action_high: Array
    episode_steps: int = 1000
    parallel_batch: int = 1
    steer: Callable[[Array, Array], Array] | None = None


class Strategy(ABC):
    """Chooses nodes and controls. Subclass it, write `select`, and `build` makes an OMPL planner of it.

    The arguments of `__init__` are the planner's options. A tree belongs to one run: `start` begins it.

    Attributes:
        space: The problem, from `start` on.
        rng: The random numbers of the run, from `start` on; take them from nowhere else.
    """

    space: Space
    rng: np.random.Generator

    def start(self, space: Space, rng: np.random.Generator) -> None:
        """Begin a new tree, which is still empty. Overriding methods call this one first."""
        self.space = space
        self.rng = rng

    def batch(self, tree: Tree) -> int:
        """Return how many nodes to select before any of them is expanded, when the user leaves it open."""
        return 1

    @abstractmethod
    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` nodes of the tree to be expanded, none of them terminal."""

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return the controls [B, A] to be tried from nodes [B]; uniform in the bounds unless overridden."""
        low, high = self.space.action_low, self.space.action_high
        return low + (high - low) * self.rng.random((len(nodes), len(low)))

    def inserted(self, tree: Tree, first: int, last: int) -> None:  # noqa: B027 - optional
        """Learn of the new nodes first, ..., last - 1; some of them may be terminal."""

    @classmethod
    def build(cls, si: Any, *, seed: int, batch: int | str = "grow", hold: int = 1, **options: Any) -> Any:
        """Return an OMPL planner with this strategy on an `ompl.control.SpaceInformation`.

        Raises:
            InvalidOption: `__init__` knows no such option, or refuses its value.
        """
        from pbcs_ompl.planners.tree_planner import TreePlanner  # it imports this module

        strategy = cls.from_options(options, cls.__name__)
        return TreePlanner(si, cls.__name__, strategy, seed=seed, batch=batch, hold=hold)

    @classmethod
    def from_options(cls, options: dict[str, Any], planner: str) -> Self:
        """Return the strategy with the options of a planner.

        Raises:
            InvalidOption: `__init__` knows no such option, or refuses its value.
        """
        known = [] if cls.__init__ is object.__init__ else keywords(cls)
        check_names(planner, options, [*known, *SHELL_OPTIONS])
        try:
            return cls(**options)
        except (TypeError, ValueError) as error:
            raise InvalidOption(f"planner {planner!r} refused the options {options}: {error}") from error
