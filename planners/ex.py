"""Ex: expand the least expanded node of the least expanded bin ([Matheron2020] 3.3)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_numbers
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels import ex_loop
from pbcs_ompl.planners.kernels.bin_queue import empty_queue, insert, reserve, select, tied_bins
from pbcs_ompl.planners.planner import Strategy


class Ex(Strategy):
    """Expand the least expanded node of the least expanded bin, in O(1) for any size of the tree.

    Source: [Matheron2020] Alg. 5.

    Differs: none when nodes are expanded one at a time, as they are wherever the environment's step is
    compiled or `batch=1`. Otherwise as many nodes are selected together as bins are tied for the lowest
    count: Alg. 5 would select each of these bins before any other too, unless a new bin comes first. Where the
    environment keeps several cores busy with p states (`parallel_batch`), it is that number rounded down to a
    multiple of p, at least p. In larger batches Ex follows new bins less far at once, which costs transitions.

    Args:
        bin_size: Edge length of the bins, one for all features or one for each; by default what the problem
            suggests.
    """

    def __init__(self, bin_size: float | Sequence[float] | None = None):
        self._given_size = None if bin_size is None else check_positive_numbers("bin_size", bin_size)
        self.queue = empty_queue(1)
        self._size = np.empty(0)

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without bins."""
        super().start(context, rng)
        self._size, turns = context.bins("bin_size", self._given_size)
        self.queue = empty_queue(len(self._size), turns)

    def resolved(self) -> dict[str, Any]:
        """Return the edges of the bins."""
        return {"bin_size": self._size.tolist()}

    @property
    def nbytes(self) -> int:
        """Bytes of the counters."""
        return self.queue.nbytes

    def batch(self, tree: Tree) -> int:
        """Return the number of bins that are tied for the lowest count, in whole portions of `parallel_batch`."""
        portion = self.context.parallel_batch
        return max(portion, tied_bins(self.queue) // portion * portion)

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` selections in a row; each raises the counts of its node and bin before the next."""
        nodes = np.empty(count, np.int64)
        self.queue = select(self.queue, self.rng.random((count, 2)), nodes)
        return nodes

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new nodes into their bins; terminal ones stay out, so they are never selected."""
        new = slice(first, last)
        self.queue = insert(self.queue, tree.features[new], tree.terminal[new], self._size, first)

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Expand nodes one at a time in compiled code (see `pbcs_ompl.planners.compiled`)."""
        bounds = np.array([self.context.action_low, self.context.action_high])
        durations = self.context.control_durations
        drawn = durations[0] < durations[1]
        uniforms = self.rng.random((max(1, count // durations[1]), 2 + bounds.shape[1] + drawn))
        tree.reserve(count)
        self.queue = reserve(self.queue, count)
        written, reached = ex_loop.expand(step.parameters, feature_dims, bounds, durations, tree.columns,
                                          len(tree), count, self.queue, self._size, uniforms)
        tree.claim(written)
        return len(tree) - 1 if reached else -1
