"""RRT without steering: expand the node nearest to a random point ([Matheron2020] 3.1.2)."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels import nearest
from pbcs_ompl.planners.planner import Strategy

NODES_PER_BATCH = 100


class RRTNH(Strategy):
    """Expand the node nearest to a random point of the feature space, by Euclidean distance.

    Source: [Matheron2020] Alg. 3, in the feature space (3.4.2).

    Differs: none with `batch=1`. Otherwise one target for each hundred nodes of the tree is drawn before any
    of their nearest nodes is expanded, so that a target misses at most one percent of the nodes that it
    might be nearest to.

    Raises:
        InvalidOption: on `start`, for a feature space without finite bounds.
    """

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without points."""
        super().start(context, rng)
        if not (np.isfinite(context.feature_low) & np.isfinite(context.feature_high)).all():
            raise InvalidOption(f"RRT draws targets from a box, but the explored feature is only bounded by "
                                f"{context.feature_low.tolist()} and {context.feature_high.tolist()}; "
                                "give the projection bounds, or use Ex")
        self._items = np.empty(1024, np.int32)
        self._size = 0

    def batch(self, tree: Tree) -> int:
        """Return one percent of the nodes."""
        return max(1, len(tree) // NODES_PER_BATCH)

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return the nodes that are nearest to `count` random targets."""
        return self.nearest_to(tree, self.draw_targets(count))

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Add the new nodes that are not terminal."""
        if self._size + last - first > len(self._items):
            self._items = np.resize(self._items, max(self._size + last - first, 3 * len(self._items) // 2))
        features = tree.columns.features
        for node in (first + np.flatnonzero(~tree.terminal[first:last])).tolist():
            self._size = nearest.insert(features, self._items, self._size, node)

    def draw_targets(self, count: int) -> np.ndarray:
        """Return random points [count, F] of the feature box."""
        low, high = self.context.feature_low, self.context.feature_high
        return low + (high - low) * self.rng.random((count, len(low)))

    def nearest_to(self, tree: Tree, targets: np.ndarray) -> IndexArray:
        """Return the nodes [B] whose features are nearest to targets [B, F]."""
        found = np.empty(len(targets), np.int64)
        nearest.nearest(tree.columns.features, self._items, self._size, targets, found)
        return found
