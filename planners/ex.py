"""Ex: expand the least expanded node of the least expanded bin ([Matheron2020] 3.3)."""

from collections.abc import Sequence

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.kernels import ex_loop
from pbcs_ompl.planners.kernels.bin_queue import empty_queue, insert, select, tied_bins
from pbcs_ompl.planners.strategy import Space, Strategy
from pbcs_ompl.planners.tree import Tree
from pbcs_ompl.planners.tree_planner import StrategyPlanner


class LeastExpanded(Strategy):
    """The choice of [Matheron2020] Alg. 5, in O(1) for any size of the tree.

    Differs: none when nodes are expanded one at a time, as they are wherever the environment's step is
    compiled or `batch=1`. Otherwise as many nodes are selected together as bins are tied for the lowest
    count: Alg. 5 would select each of these bins before any other too, unless a new bin cuts in. Where the
    environment keeps several cores busy with p states (`parallel_batch`), it is that number rounded down to a
    multiple of p, at least p. Larger batches make Ex forget its dives into new bins, which costs transitions.

    Args:
        bin_size: Edge length of the bins, one for all features or one for each; by default what the problem
            suggests.
    """

    def __init__(self, bin_size: float | Sequence[float] | None = None):
        self._wanted_size = None if bin_size is None else _checked_size(bin_size)
        self.queue = empty_queue(1)
        self._size = np.empty(0)

    def start(self, space: Space, rng: np.random.Generator) -> None:
        """Begin without bins."""
        super().start(space, rng)
        features = len(space.bin_size)
        size = space.bin_size if self._wanted_size is None else self._wanted_size
        if len(size) not in (1, features):
            raise InvalidOption(f"bin_size has {len(size)} numbers; expected 1, or {features}")
        self._size = np.array(np.broadcast_to(size, features))
        self.queue = empty_queue(features)

    @property
    def nbytes(self) -> int:
        """Bytes of the counters."""
        return self.queue.nbytes

    def batch(self, tree: Tree) -> int:
        """Return the number of bins that are tied for the lowest count, in whole portions of `parallel_batch`."""
        portion = self.space.parallel_batch
        return max(portion, tied_bins(self.queue) // portion * portion)

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` selections in a row; each raises the counts of its node and bin before the next."""
        nodes = np.empty(count, np.int64)
        select(self.queue, self.rng.random((count, 2)), nodes)
        return nodes

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new nodes into their bins; terminal ones stay out, so they are never selected."""
        new = slice(first, last)
        self.queue = insert(self.queue, tree.features[new], tree.terminal[new], self._size, first)

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Expand up to `count` nodes one at a time in compiled code (see `pbcs_ompl.planners.compiled`)."""
        bounds = np.array([self.space.action_low, self.space.action_high])
        uniforms = self.rng.random((count, 2 + bounds.shape[1]))
        tree.reserve(count)
        done = 0
        while done < count:
            first = len(tree)
            written, reason = ex_loop.expand(step.step, step[1:], feature_dims, bounds, tree.columns, first,
                                             self.queue, self._size, uniforms[done:])
            tree.claim(written)
            done += written
            if reason == ex_loop.NOT_FINITE:
                break
            if reason != ex_loop.DONE:
                self.inserted(tree, len(tree) - 1, len(tree))
            if reason == ex_loop.GOAL:
                return len(tree) - 1
        return -1


class Ex(StrategyPlanner):
    """Ex as an OMPL planner, for any `ompl.control.SpaceInformation`; options: see LeastExpanded."""

    strategy_class = LeastExpanded


def _checked_size(size: float | Sequence[float]) -> Array:
    numbers = np.atleast_1d(np.asarray(size, dtype=np.float64))
    if numbers.ndim != 1 or not (np.isfinite(numbers) & (numbers > 0)).all():
        raise InvalidOption(f"bin_size={size!r}: expected finite numbers above 0")
    return numbers
