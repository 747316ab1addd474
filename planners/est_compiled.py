"""OMPL's EST as a compiled strategy."""

from typing import Any

import numpy as np

from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.grid_strategy import GridStrategy
from pbcs_ompl.planners.kernels import est_loop
from pbcs_ompl.planners.kernels.grid import reserve
from pbcs_ompl.planners.motions import ends_of


class ESTCompiled(GridStrategy):
    """Draw a cell in proportion to 1 / (motions that end in it), and any of these motions.

    Source: OMPL's control::EST (Hsu, Latombe and Motwani 1999), so that times compare algorithms instead of bindings.

    Differs: it does not ask for a valid state near the node first, which has no influence on the control.

    Args:
        bin_size: Edge length of the cells, one for all features or one for each; by default what the problem
            suggests.
    """

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without cells."""
        super().start(context, rng)
        self._weights = np.zeros(2 * len(self._grid.cells))

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` independent draws."""
        return np.array([est_loop.select(self._grid, self._weights, self.rng) for _ in range(count)], np.int64)

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the ends of the new motions into their cells."""
        self._reserve(last - first)
        cell = np.empty(len(self._size), np.int64)
        for node in ends_of(tree, first, last).tolist():
            est_loop.insert(self._grid, self._weights, tree.columns.features, node, self._size, cell)

    def _compiled(self) -> tuple[Any, Any]:
        return est_loop.expand, self._weights

    def _reserve(self, count: int) -> None:
        self._grid = reserve(self._grid, count)
        leaves = 1 << (len(self._grid.cells) - 1).bit_length()
        if 2 * leaves > len(self._weights):
            old, self._weights = self._weights, np.zeros(2 * leaves)
            for number, weight in enumerate(old[len(old) // 2:][:int(self._grid.totals[0])].tolist()):
                est_loop.weigh(self._weights, number, weight)
