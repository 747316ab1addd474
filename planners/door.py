"""What the shell needs of a problem, however its states are kept: the doors implement it."""

from abc import ABC, abstractmethod
from typing import Any

from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.planners.strategy import Space
from pbcs_ompl.planners.tree import Tree


class Door(ABC):
    """A way into a control problem.

    Attributes:
        counter: Where every transition is counted.
        widest_batch: The most nodes that are worth expanding together.
    """

    counter: Counter
    widest_batch: int

    @abstractmethod
    def space(self) -> Space:
        """Describe the problem for a strategy."""

    @abstractmethod
    def new_tree(self) -> Tree:
        """Return an empty tree; forget the states of the one before."""

    @abstractmethod
    def add_root(self, tree: Tree, state: Any, goal: Any) -> bool:
        """Add an OMPL start state; return whether it is in the goal."""

    @abstractmethod
    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, goal: Any) -> int:
        """Add what follows from nodes [B] under controls [B, A], up to the first in the goal.

        Returns:
            The node in the goal, or -1.

        Raises:
            CallbackFailed: a state is not finite.
        """

    @abstractmethod
    def path(self, tree: Tree, nodes: IndexArray) -> Any:
        """Return the `ompl.control.PathControl` through nodes [T + 1]."""

    @abstractmethod
    def state(self, tree: Tree, node: int) -> Any:
        """Return a node's OMPL state."""
