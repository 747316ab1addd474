"""RidesSST: Rides until the first solution, and SST from its tree for shorter ones."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels.witnesses import note_tree, reserve
from pbcs_ompl.planners.rides import Rides
from pbcs_ompl.planners.sst_compiled import SSTCompiled


class RidesSST(SSTCompiled):
    """Search as Rides; after the first solution continue as SST, from all nodes of the tree.

    Half of the targets of SST are around the shortest path so far, half of its controls on the surface of their bounds.

    Source: ours, of Rides and SSTCompiled.

    Args:
        bin_size: Edge length of the bins of Rides, one for all features or one for each; by default what the problem
            suggests.
        selection_radius: How near to a random feature SST expands the cheapest node, in bins that the problem suggests.
        pruning_radius: Within which distance of a witness only the cheapest node is kept, in bins.

    Raises:
        InvalidOption: on `start`, for a feature space without finite bounds.
    """

    _beside_path = 0.5
    _on_surface = 0.5

    def __init__(self, bin_size: float | Sequence[float] | None = None, selection_radius: float = 3.0,
                 pruning_radius: float = 1.0):
        super().__init__(selection_radius, pruning_radius)
        self._rides = Rides(bin_size)

    @property
    def _searching(self) -> bool:
        return not len(self._focus.path)

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without regions and witnesses."""
        super().start(context, rng)
        self._rides.start(context, rng)

    def resolved(self) -> dict[str, Any]:
        """Return the edges of the bins of Rides."""
        return self._rides.resolved()

    def batch(self, tree: Tree) -> int:
        """Return how many rides go on side by side, and as many motions of SST."""
        return self._rides.batch(tree)

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return where rides are, or the cheapest nodes near random features."""
        return self._rides.select(tree, count) if self._searching else super().select(tree, count)

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return the controls [B, A] of the rides, or random ones."""
        return self._rides.controls(tree, nodes) if self._searching else super().controls(tree, nodes)

    def durations(self, tree: Tree, nodes: IndexArray) -> IndexArray:
        """Return for how many steps [B] the controls last."""
        return self._rides.durations(tree, nodes) if self._searching else super().durations(tree, nodes)

    def reached(self, tree: Tree, node: int) -> None:
        """Note the shortest path so far; with the first, let the nodes of the tree find their witnesses."""
        first = self._searching
        super().reached(tree, node)
        if first:
            self._witnesses = reserve(self._witnesses, len(tree))
            note_tree(self._witnesses, tree.columns, len(tree), self._size, self._radii[1], len(self._focus.path) - 1)

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new nodes into the bins of Rides, or the ends of motions to their witnesses."""
        if self._searching:
            self._rides.inserted(tree, first, last)
        else:
            super().inserted(tree, first, last)

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Ride, or add motions, in compiled code (see `pbcs_ompl.planners.compiled`)."""
        if not self._searching:
            return super().expand(tree, step, feature_dims, count)
        found = self._rides.expand(tree, step, feature_dims, count)
        if found >= 0:
            self.reached(tree, found)
        return found
