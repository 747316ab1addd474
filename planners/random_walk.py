"""The unbiased random walk that the other planners are compared with ([Matheron2020] 3.1.3)."""

import numpy as np

from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.options import positive_integer
from pbcs_ompl.planners.strategy import Space, Strategy
from pbcs_ompl.planners.tree import Tree
from pbcs_ompl.planners.tree_planner import StrategyPlanner


class Walkers(Strategy):
    """Walk from the root with random actions; begin again at a terminal state or after `max_steps`.

    Args:
        max_steps: Length of a walk; by default the length of an episode.
        walkers: Independent walks that advance side by side.
    """

    def __init__(self, max_steps: int | None = None, walkers: int = 1):
        self._max_steps = None if max_steps is None else positive_integer("max_steps", max_steps)
        self._walkers = positive_integer("walkers", walkers)

    def start(self, space: Space, rng: np.random.Generator) -> None:
        """Put the walkers to the root."""
        super().start(space, rng)
        self._limit = self._max_steps or space.episode_steps
        self._at = np.zeros(self._walkers, np.int64)
        self._steps = np.zeros(self._walkers, np.int64)

    def batch(self, tree: Tree) -> int:
        """Return the number of walkers."""
        return self._walkers

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return where the walkers are; a larger batch brings in more of them."""
        missing = count - len(self._at)
        if missing > 0:
            self._at = np.append(self._at, np.zeros(missing, np.int64))
            self._steps = np.append(self._steps, np.zeros(missing, np.int64))
        return self._at[:count].copy()

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Move the walkers on; those that could not move stay where they are."""
        if first == 0:
            return
        walker = 0
        moved: dict[int, int] = {}  # the walker behind each new node
        for node, parent, terminal in zip(range(first, last), tree.parents[first:last].tolist(),
                                          tree.terminal[first:last].tolist(), strict=True):
            if parent >= first:  # the control of a new node is held on
                mover = moved[parent]
                moved[node] = mover
                if self._at[mover] != parent:  # its walk was over
                    continue
            else:
                while self._at[walker] != parent:
                    walker += 1
                mover = moved[node] = walker
                walker += 1
            self._steps[mover] += 1
            over = terminal or self._steps[mover] >= self._limit
            self._at[mover] = 0 if over else node
            if over:
                self._steps[mover] = 0


class RandomWalk(StrategyPlanner):
    """Random walks as an OMPL planner, for any `ompl.control.SpaceInformation`."""

    strategy_class = Walkers
