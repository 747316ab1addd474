"""EST for reinforcement learning: random actions from nodes in sparse regions ([Matheron2020] 3.2)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_numbers, check_range
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels.bin_queue import empty_queue, insert
from pbcs_ompl.planners.kernels.sparse import draw_sparse, draw_sparsest
from pbcs_ompl.planners.planner import Strategy

RULES = ("draw", "least")
NODES_PER_BATCH = 100
MOST_FEATURES = 4
"""Beyond this number of features the bins around a bin are too many to visit."""


class ESTAdapted(Strategy):
    """Draw nodes with probability proportional to 1 / omega(s), omega the number of nodes within d of s.

    Source: [Matheron2020] 3.2, whose text and Fig. 3.5 give two rules: the figure draws by 1 / omega, the text takes "a
    node x that minimizes omega(x)" (`rule="least"`).

    Differs: for the ball of radius d stand the 3^F bins of edge 2 d / 3 around s's bin, a box of edge 2 d;
    with more than four features, s's bin of edge 2 d alone. And the nodes of a batch (one percent of the
    tree, 1 with `batch=1`) do not see each other's children. OMPL's EST draws cells by 1 / n and then any
    of their n nodes: that is 1 / n^2 for a node, more eager than the thesis's rule.

    Args:
        distance: d, one for all features or one for each; by default the bin size that the problem suggests.
        rule: "draw" or "least": any of the nodes with the least omega, all as likely.
    """

    def __init__(self, distance: float | Sequence[float] | None = None, rule: str = "draw"):
        check_range("rule", rule, rule in RULES, f"one of {', '.join(RULES)}")
        self._rule = rule
        self._given_distance = None if distance is None else check_positive_numbers("distance", distance)

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without bins."""
        super().start(context, rng)
        self._distance = context.edge_lengths("distance", self._given_distance)
        features = len(self._distance)
        self._reach = 1 if features <= MOST_FEATURES else 0
        self._size = 2.0 * self._distance / (2 * self._reach + 1)
        self._bins = empty_queue(features)

    def resolved(self) -> dict[str, Any]:
        """Return d for each feature, and the rule."""
        return {"distance": self._distance.tolist(), "rule": self._rule}

    def batch(self, tree: Tree) -> int:
        """Return one percent of the nodes."""
        return max(1, len(tree) // NODES_PER_BATCH)

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` independent draws."""
        nodes = np.empty(count, np.int64)
        (draw_sparse if self._rule == "draw" else draw_sparsest)(self._bins, self._reach, self.rng, nodes)
        return nodes

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new nodes that are not terminal into their bins."""
        new = slice(first, last)
        self._bins = insert(self._bins, tree.features[new], tree.terminal[new], self._size, first)
