"""OMPL's RRT as a compiled strategy."""

import numpy as np

from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.kernels import nearest, rrt_loop
from pbcs_ompl.planners.motions import bounds_of, ends_of
from pbcs_ompl.planners.rrt_nh import RRTNH


class RRTCompiled(RRTNH):
    """Expand the end of a motion that is nearest to a random point of the feature space.

    Source: OMPL's control::RRT without goal bias (LaValle and Kuffner 2001), so that times compare algorithms instead
    of bindings. With controls of one step it is RRTNH with `batch=1`.

    Differs: distances are those of features instead of states.

    Raises:
        InvalidOption: on `start`, for a feature space without finite bounds.
    """

    def batch(self, tree: Tree) -> int:
        """Return 1."""
        return 1

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Add the ends of the new motions."""
        self._reserve(last - first)
        for node in ends_of(tree, first, last).tolist():
            self._size = nearest.insert(tree.columns.features, self._items, self._size, node)

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Add motions in compiled code (see `pbcs_ompl.planners.compiled`)."""
        tree.reserve(count)
        self._reserve(count)
        box = np.array([self.context.feature_low, self.context.feature_high])
        written, reached, self._size = rrt_loop.expand(
            step.parameters, feature_dims, bounds_of(self.context), self.context.control_durations, tree.columns,
            len(tree), count, box, self._items, self._size, self.rng)
        tree.claim(written)
        return len(tree) - 1 if reached else -1

    def _reserve(self, count: int) -> None:
        if self._size + count > len(self._items):
            self._items = np.resize(self._items, max(self._size + count, 2 * len(self._items)))
