"""OMPL's KPIECE1 as a compiled strategy."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_numbers
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels import kpiece_loop
from pbcs_ompl.planners.kernels.grid import CELLS, empty_grid, reserve
from pbcs_ompl.planners.motions import bounds_of, motions_of
from pbcs_ompl.planners.planner import Strategy


class KPIECE1Compiled(Strategy):
    """Expand the most important cell: of late birth, few selections, few motions, few neighbours.

    Source: OMPL's control::KPIECE1 (Sucan and Kavraki 2008), so that times compare algorithms instead of bindings.

    Differs: it does not know how far the goal is. OMPL's divides the first score of a cell by the distance to the
    goal, and expands in one of twenty iterations the motion that is nearest to it.

    Args:
        bin_size: Edge length of the cells, one for all features or one for each; by default what the problem
            suggests.
    """

    def __init__(self, bin_size: float | Sequence[float] | None = None):
        self._given_size = None if bin_size is None else check_positive_numbers("bin_size", bin_size)

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without cells."""
        super().start(context, rng)
        self._size, turns = context.bins("bin_size", self._given_size)
        self._grid, self._judged = empty_grid(turns), kpiece_loop.none_judged()
        self._selected: list[int] = []

    def resolved(self) -> dict[str, Any]:
        """Return the edges of the cells."""
        return {"bin_size": self._size.tolist()}

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

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Add motions in compiled code (see `pbcs_ompl.planners.compiled`)."""
        tree.reserve(count)
        self._reserve(count)
        written, reached = kpiece_loop.expand(step.parameters, feature_dims, bounds_of(self.context),
                                              self.context.control_durations, tree.columns, len(tree), count,
                                              self._grid, self._judged, self._size, self.rng)
        tree.claim(written)
        return len(tree) - 1 if reached else -1

    def _reserve(self, count: int) -> None:
        self._grid = reserve(self._grid, count)
        self._judged = kpiece_loop.reserve(self._judged, int(self._grid.totals[CELLS]) + count)
