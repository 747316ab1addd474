"""RRT with steering: go towards a random point from the node nearest to it ([Matheron2020] 3.1.1)."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.rrt_nh import NearestToRandom
from pbcs_ompl.planners.strategy import Space
from pbcs_ompl.planners.tree import Tree
from pbcs_ompl.planners.tree_planner import StrategyPlanner


class SteerToRandom(NearestToRandom):
    """[Matheron2020] Alg. 2 in the feature space, with the environment's `advance_towards`; batches as RRTNH.

    Raises:
        InvalidOption: on `start`, for an environment or OMPL problem that offers no steering.
    """

    def start(self, space: Space, rng: np.random.Generator) -> None:
        """Begin without points."""
        super().start(space, rng)
        if space.steer is None:
            raise InvalidOption("RRTSteered needs steering, and a plain OMPL problem offers none; use RRTNH")
        self._steer = space.steer

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return the nodes that are nearest to `count` random targets, which `controls` will need."""
        self._targets = self.draw_targets(count)
        return self.nearest_to(tree, self._targets)

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return the controls [B, A] that lead towards the targets."""
        return self._steer(tree.states[nodes], self._targets)


class RRTSteered(StrategyPlanner):
    """RRT with steering as an OMPL planner, on environments that can steer."""

    strategy_class = SteerToRandom
