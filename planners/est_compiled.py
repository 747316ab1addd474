"""OMPL's EST as a compiled strategy."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_numbers
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels import est_loop
from pbcs_ompl.planners.kernels.grid import empty_grid, reserve
from pbcs_ompl.planners.motions import bounds_of, ends_of
from pbcs_ompl.planners.planner import Strategy


class ESTCompiled(Strategy):
    """Draw a cell in proportion to 1 / (motions that end in it), and any of these motions.

    Source: OMPL's control::EST (Hsu, Latombe and Motwani 1999), so that times compare algorithms instead of bindings.

    Differs: it does not ask for a valid state near the node first, which has no influence on the control.

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
        self._grid = empty_grid(turns)
        self._weights = np.zeros(2 * len(self._grid.cells))

    def resolved(self) -> dict[str, Any]:
        """Return the edges of the cells."""
        return {"bin_size": self._size.tolist()}

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` independent draws."""
        return np.array([est_loop.select(self._grid, self._weights, self.rng) for _ in range(count)], np.int64)

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the ends of the new motions into their cells."""
        self._reserve(last - first)
        cell = np.empty(len(self._size), np.int64)
        for node in ends_of(tree, first, last).tolist():
            est_loop.insert(self._grid, self._weights, tree.columns.features, node, self._size, cell)

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Add motions in compiled code (see `pbcs_ompl.planners.compiled`)."""
        tree.reserve(count)
        self._reserve(count)
        written, reached = est_loop.expand(step.parameters, feature_dims, bounds_of(self.context),
                                           self.context.control_durations, tree.columns, len(tree), count,
                                           self._grid, self._weights, self._size, self.rng)
        tree.claim(written)
        return len(tree) - 1 if reached else -1

    def _reserve(self, count: int) -> None:
        self._grid = reserve(self._grid, count)
        leaves = 1 << (len(self._grid.cells) - 1).bit_length()
        if 2 * leaves > len(self._weights):
            old, self._weights = self._weights, np.zeros(2 * leaves)
            for number, weight in enumerate(old[len(old) // 2:][:int(self._grid.totals[0])].tolist()):
                est_loop.weigh(self._weights, number, weight)
