"""OMPL's KPIECE1 as a compiled strategy."""

from typing import Any

import numpy as np

from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.grid_strategy import GridStrategy
from pbcs_ompl.planners.kernels import kpiece_loop
from pbcs_ompl.planners.kernels.grid import CELLS, reserve
from pbcs_ompl.planners.motions import motions_of


class KPIECE1Compiled(GridStrategy):
    """Expand the most important cell: of late birth, few selections, few motions, few neighbours.

    Source: OMPL's control::KPIECE1 (Sucan and Kavraki 2008), so that times compare algorithms instead of bindings.

    Differs: it does not know how far the goal is. OMPL's divides the first score of a cell by the distance to the
    goal, and expands in one of twenty iterations the motion that is nearest to it.

    Args:
        bin_size: Edge length of the cells, one for all features or one for each; by default what the problem
            suggests.
    """

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without cells."""
        super().start(context, rng)
        self._judged = kpiece_loop.none_judged()
        self._selected: list[int] = []

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` selections in a row."""
        chosen = [kpiece_loop.select(self._grid, self._judged, self.rng) for _ in range(count)]
        self._selected = [int(number) for number, _ in chosen]
        return np.array([node for _, node in chosen], np.int64)

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new motions into their cells."""
        self._reserve(last - first)
        features, motions = tree.columns.features, motions_of(tree, first, last)
        if tree.parents[first] < 0:
            for node in (first + np.flatnonzero(~tree.terminal[first:last])).tolist():
                kpiece_loop.add(self._grid, self._judged, features, node, 0, self._size,
                                np.empty(len(self._size), np.int64))
            return
        for number, motion in zip(self._selected, motions, strict=False):  # a budget may cut off the last ones
            alive = np.array([node for node in motion if not tree.terminal[node]], np.int64)
            kpiece_loop.note(self._grid, self._judged, features, alive, number, self._size, self.rng)

    def _compiled(self) -> tuple[Any, Any]:
        return kpiece_loop.expand, self._judged

    def _reserve(self, count: int) -> None:
        self._grid = reserve(self._grid, count)
        self._judged = kpiece_loop.reserve(self._judged, int(self._grid.totals[CELLS]) + count)
