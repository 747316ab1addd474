"""RRT with steering: go towards a random point from the node nearest to it ([Matheron2020] 3.1.1)."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.rrt_nh import RRTNH


class RRTSteered(RRTNH):
    """Steer towards the random point with the environment's `advance_towards`; batches as RRTNH.

    Source: [Matheron2020] Alg. 2, in the feature space.

    Raises:
        InvalidOption: on `start`, for an environment or OMPL problem that offers no steering.
    """

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without points."""
        super().start(context, rng)
        if context.steer is None:
            raise InvalidOption("RRTSteered needs steering, and a plain OMPL problem offers none; use RRTNH")
        self._steer = context.steer

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return the nodes that are nearest to `count` random targets, which `controls` will need."""
        self._targets = self.draw_targets(count)
        return self.nearest_to(tree, self._targets)

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return the controls [B, A] that lead towards the targets."""
        return self._steer(tree.states[nodes], self._targets)
