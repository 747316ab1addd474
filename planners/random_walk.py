"""The unbiased random walk that the other planners are compared with ([Matheron2020] 3.1.3)."""

from itertools import cycle
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_integer
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.planner import Strategy


class RandomWalk(Strategy):
    """Walk from a root with random actions; restart at a terminal state or after `max_steps`.

    Several roots are taken in turn.

    Args:
        max_steps: Length of a walk; by default the length of an episode.
        walkers: Independent walks that advance side by side.
    """

    def __init__(self, max_steps: int | None = None, walkers: int = 1):
        self._given_steps = None if max_steps is None else check_positive_integer("max_steps", max_steps)
        self._walkers = check_positive_integer("walkers", walkers)

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without walkers."""
        super().start(context, rng)
        self._max_steps = self._given_steps or context.episode_steps
        self._at = np.empty(0, np.int64)
        self._steps = np.empty(0, np.int64)
        self._roots = cycle([0])

    def resolved(self) -> dict[str, Any]:
        """Return the length of a walk."""
        return {"max_steps": self._max_steps}

    def batch(self, tree: Tree) -> int:
        """Return the number of walkers."""
        return self._walkers

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return where the walkers are; a larger batch adds walkers."""
        missing = count - len(self._at)
        if missing > 0:
            self._at = np.append(self._at, [next(self._roots) for _ in range(missing)])
            self._steps = np.append(self._steps, np.zeros(missing, np.int64))
        return self._at[:count].copy()

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Move the walkers; those that could not move stay where they are."""
        parents = tree.parents[first:last].tolist()
        if parents[0] < 0:  # the next walks start at the newest roots
            self._roots = cycle([*range(first, last), *np.flatnonzero(tree.parents[:first] < 0).tolist()])
            return
        walker = 0
        moved: dict[int, int] = {}  # the walker behind each new node
        for node, parent, terminal in zip(range(first, last), parents, tree.terminal[first:last].tolist(), strict=True):
            if parent >= first:  # the control of a new node was applied again
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
            over = terminal or self._steps[mover] >= self._max_steps
            self._at[mover] = next(self._roots) if over else node
            if over:
                self._steps[mover] = 0
