"""What strategies share that keep nodes in the cells of a grid, as OMPL's planners on projections do."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_numbers
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels.grid import empty_grid
from pbcs_ompl.planners.motions import bounds_of
from pbcs_ompl.planners.planner import Strategy


class GridStrategy(Strategy):
    """Nodes in cells of one size.

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

    def resolved(self) -> dict[str, Any]:
        """Return the edges of the cells."""
        return {"bin_size": self._size.tolist()}

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Add motions in compiled code (see `pbcs_ompl.planners.compiled`)."""
        tree.reserve(count)
        self._reserve(count)
        loop, kept = self._compiled()
        written, reached = loop(step.parameters, feature_dims, bounds_of(self.context),
                                self.context.control_durations, tree.columns, len(tree), count, self._grid, kept,
                                self._size, self.rng)
        tree.claim(written)
        return len(tree) - 1 if reached else -1

    @abstractmethod
    def _compiled(self) -> tuple[Any, Any]:
        """Return the compiled loop, and what it keeps of the cells beside the grid."""

    @abstractmethod
    def _reserve(self, count: int) -> None:
        """Make space for `count` more nodes."""
