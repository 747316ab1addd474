"""SST as a compiled strategy: it continues after its first solution, and finds shorter ones."""

from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.options import check_positive_numbers, check_range
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels import sst_loop
from pbcs_ompl.planners.kernels.motion import to_surface
from pbcs_ompl.planners.kernels.witnesses import choose, no_witnesses, note, reserve
from pbcs_ompl.planners.motions import bounds_of, ends_of
from pbcs_ompl.planners.planner import Strategy


class SSTCompiled(Strategy):
    """Expand the cheapest node near a random feature; of nodes near to each other keep only the cheapest.

    Source: SST (Li, Littlefield and Bekris 2016). The cost of a node is the steps to it.

    Differs: distances are those of features, in bins, instead of states. Near a random feature are the nodes whose
    witnesses are. Nothing is removed: nodes that are not the cheapest are only not expanded any more, as those that
    have as many steps as the shortest path so far.

    Args:
        selection_radius: How near to a random feature the cheapest node is expanded, in bins.
        pruning_radius: Within which distance of a witness only the cheapest node is kept, in bins.

    Raises:
        InvalidOption: on `start`, for a feature space without finite bounds.
    """

    continues = True
    _beside_path = 0.0
    _on_surface = 0.0

    def __init__(self, selection_radius: float = 3.0, pruning_radius: float = 1.0):
        self._radii = _radius("selection_radius", selection_radius), _radius("pruning_radius", pruning_radius)

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return the options of the planner with their defaults: with single steps few nodes leave their witness."""
        return {**super().options(), "control_duration": [1, 10]}

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without witnesses."""
        super().start(context, rng)
        box = np.array([context.feature_low, context.feature_high])
        if not np.isfinite(box).all():
            raise InvalidOption(f"{type(self).__name__} draws targets from a box, but the explored feature is only "
                                f"bounded by {box.tolist()}; give the projection bounds, or use Ex")
        self._size = context.edge_lengths("bin_size", None)
        self._focus = sst_loop.Focus(box / self._size, np.empty(0, np.int64), self._beside_path)
        self._witnesses = no_witnesses(len(self._size))
        self._chosen: list[int] = []

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return the cheapest nodes near `count` random features."""
        point, best = np.empty((1, len(self._size))), sst_loop.steps_of(self._focus.path)
        self._chosen = []
        for _ in range(count):
            sst_loop.draw_target(self._focus, tree.columns.features, self._size, self._radii[0], point, self.rng)
            self._chosen.append(int(choose(self._witnesses, point, self._radii[0], best)))
        return self._witnesses.nodes[self._chosen].astype(np.int64)

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return random controls [B, A]: uniform in their bounds, or scaled to their surface."""
        drawn, bounds = super().controls(tree, nodes), bounds_of(self.context)
        if self._on_surface > 0.0:
            for row in np.flatnonzero(self.rng.random(len(nodes)) < self._on_surface).tolist():
                to_surface(bounds, drawn, row)
        return drawn

    def durations(self, tree: Tree, nodes: IndexArray) -> IndexArray:
        """Return for how many steps [B] the controls last: none so long that its end is no shorter path."""
        most = sst_loop.steps_of(self._focus.path) - 1 - self._witnesses.costs[self._chosen].astype(np.int64)
        return np.minimum(super().durations(tree, nodes), most)

    def reached(self, tree: Tree, node: int) -> None:
        """Note the shortest path so far."""
        self._focus = self._focus._replace(path=tree.path_to(node))

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Make the ends of new motions witnesses, or let those stand for their witnesses that are the cheapest."""
        self._witnesses = reserve(self._witnesses, last - first)
        best, found = sst_loop.steps_of(self._focus.path), np.empty(1, np.int64)
        for node in ends_of(tree, first, last).tolist():
            cost = len(tree.path_to(node)) - 1
            if cost < best:
                note(self._witnesses, tree.features[node:node + 1] / self._size, found, node, cost, self._radii[1])

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Add motions in compiled code (see `pbcs_ompl.planners.compiled`)."""
        tree.reserve(count)
        self._witnesses = reserve(self._witnesses, count)
        written, reached = sst_loop.expand(
            step.parameters, feature_dims, bounds_of(self.context), self.context.control_durations, tree.columns,
            len(tree), count, self._focus, self._witnesses, self._size, self._radii, self._on_surface, self.rng)
        tree.claim(written)
        if not reached:
            return -1
        self.reached(tree, len(tree) - 1)
        return len(tree) - 1


def _radius(name: str, value: Any) -> float:
    numbers = check_positive_numbers(name, value)
    check_range(name, value, len(numbers) == 1, "a number above 0")
    return float(numbers[0])
