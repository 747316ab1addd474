"""EST for reinforcement learning: random actions from nodes in sparse regions ([Matheron2020] 3.2)."""

import numpy as np

from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.kernels.bin_queue import empty_queue, insert
from pbcs_ompl.planners.kernels.sparse import draw_sparse
from pbcs_ompl.planners.options import positive
from pbcs_ompl.planners.strategy import Space, Strategy
from pbcs_ompl.planners.tree import Tree
from pbcs_ompl.planners.tree_planner import StrategyPlanner

NODES_PER_BATCH = 100
WIDEST = 4
"""Beyond this number of features the bins around a bin are too many to look at."""


class SparseFirst(Strategy):
    """Draw nodes with probability proportional to 1 / omega(s), omega the number of nodes within d of s.

    Differs: for the ball of radius d stand the 3^F bins of edge 2 d / 3 around s's bin, a box of edge 2 d;
    with more than four features, s's bin of edge 2 d alone. And the nodes of a batch (one percent of the
    tree, 1 with `batch=1`) do not see each other's children. OMPL's EST draws cells by 1 / n and then any
    of their n nodes: that is 1 / n^2 for a node, more eager than the thesis's rule.

    Args:
        distance: d; by default the bin size that the problem suggests, along each feature.
    """

    def __init__(self, distance: float | None = None):
        self._distance = None if distance is None else positive("distance", distance)

    def start(self, space: Space, rng: np.random.Generator) -> None:
        """Begin without bins."""
        super().start(space, rng)
        features = len(space.bin_size)
        distance = np.array(space.bin_size) if self._distance is None else np.full(features, self._distance)
        self._reach = 1 if features <= WIDEST else 0
        self._size = 2.0 * distance / (2 * self._reach + 1)
        self._bins = empty_queue(features)

    def batch(self, tree: Tree) -> int:
        """Return one percent of the nodes."""
        return max(1, len(tree) // NODES_PER_BATCH)

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` independent draws."""
        nodes = np.empty(count, np.int64)
        draw_sparse(self._bins, self._reach, self.rng, nodes)
        return nodes

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new nodes that are not terminal into their bins."""
        new = slice(first, last)
        self._bins = insert(self._bins, tree.features[new], tree.terminal[new], self._size, first)


class ESTAdapted(StrategyPlanner):
    """EST with random actions as an OMPL planner, for any `ompl.control.SpaceInformation`."""

    strategy_class = SparseFirst
