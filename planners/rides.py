"""Rides: hold a control as long as it opens new bins, from regions of several sizes where few rides began."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.options import check_positive_integer, check_positive_numbers, check_range
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import CompiledStep
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels import rides_loop
from pbcs_ompl.planners.kernels.regions import no_regions, reserve
from pbcs_ompl.planners.planner import Strategy

MOST_SCALES = 16
QUESTIONS = 3  # which scale, which kind of control, which patience


class Rides(Strategy):
    """Begin rides where few began, and ride on while new bins are opened.

    1. Choose a scale (regions of 1, 2, 4, ... bins' edge), a kind of control (uniform in its box, or the same scaled to
       the surface of the box) and a patience (1, 2, 4, ... 32 steps), each in proportion to (bins opened / steps
       used with it so far)^4.
    2. Take a region of that scale with the fewest rides begun in it, within it the region of the next smaller scale
       with the fewest, down to a bin, and any node of the bin. In a region all of whose neighbours are known rides
       count four times.
    3. Apply a control of that kind until the state does not change, or two known bins in a row were entered, or
       `patience` steps in a row opened no bin, or the episode ends.

    Source: ours. Cells of which exterior ones come first are from KPIECE (Sucan & Kavraki 2008), held random controls
    from eps-z-greedy (Dabney et al. 2020), counted cells from Go-Explore (Ecoffet et al. 2019) and Ex; what is
    new is to end a control by what it opens, and to choose scale, kind and patience by what they opened.

    The choices of a ride take O(scales x 2^features), a step O(1), and the memory is proportional to the nodes. Where
    the environment keeps several cores busy with p states (`parallel_batch`), p rides go on side by side.

    Args:
        bin_size: Edge length of the bins, one for all features or one for each; by default what the problem
            suggests.
        scales: How many sizes of regions there are.
    """

    def __init__(self, bin_size: float | Sequence[float] | None = None, scales: int = 5):
        self._given_size = None if bin_size is None else check_positive_numbers("bin_size", bin_size)
        self._scales = check_positive_integer("scales", scales)
        check_range("scales", scales, scales <= MOST_SCALES, f"1 to {MOST_SCALES}")
        self._size = np.empty(0)
        self.regions = no_regions(1, 1)

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return the options of the planner with their defaults; how long controls last is not one of them."""
        return {name: default for name, default in super().options().items() if name != "control_duration"}

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without regions."""
        super().start(context, rng)
        self._size, turns = context.bins("bin_size", self._given_size)
        self.regions = no_regions(len(self._size), self._scales, turns)
        self._bounds = np.array([context.action_low, context.action_high])
        self._yields = np.ones((QUESTIONS, max(self._scales, rides_loop.KINDS, rides_loop.PATIENCES), 3))
        self._rides = np.zeros((0, 10), np.int64)
        self._actions = np.empty((0, self._bounds.shape[1]))
        self._riding = self._placed = 0
        self._limits = rides_loop.Limits(context.episode_steps)

    def resolved(self) -> dict[str, Any]:
        """Return the edges of the bins."""
        return {"bin_size": self._size.tolist()}

    @property
    def nbytes(self) -> int:
        """Bytes of the regions."""
        return self.regions.nbytes

    def batch(self, tree: Tree) -> int:
        """Return how many rides go on side by side."""
        return self.context.parallel_batch

    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return where the first `count` rides are; those that had ended begin again."""
        if self._placed < len(tree):
            self._place(tree)
        self._add_rides(count)
        rides_loop.begin(self.regions, self._yields, self._bounds, self._rides, self._actions, count, self.rng)
        self._riding = count
        return self._rides[:count, rides_loop.NODE].copy()

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return the controls of the rides [B, A]."""
        return self._actions[:len(nodes)].copy()

    def durations(self, tree: Tree, nodes: IndexArray) -> IndexArray:
        """Return the least number of steps [B]: whether a control lasts longer is decided after each."""
        return np.full(len(nodes), self.context.control_durations[0])

    def inserted(self, tree: Tree, first: int, last: int) -> None:
        """Put the new nodes into their bins, and end the rides that are over; roots wait for what follows."""
        if tree.parents[first] >= 0:
            self._place(tree)

    def expand(self, tree: Tree, step: CompiledStep, feature_dims: IndexArray, count: int) -> int:
        """Ride for `count` steps in compiled code (see `pbcs_ompl.planners.compiled`)."""
        roots, end = len(tree) - self._placed, len(tree) + count
        tree.reserve(count)
        self._add_rides(1)
        self.regions = reserve(self.regions, roots + count, roots + 1)
        written, reached = rides_loop.explore(
            step.parameters, feature_dims, self._bounds, tree.columns, (self._placed, len(tree), end), self.regions,
            self._size, self._limits, self._yields, self._rides, self._actions, self.rng)
        tree.claim(written)
        self._placed = len(tree)
        return len(tree) - 1 if reached else -1

    def _place(self, tree: Tree) -> None:
        """Put the nodes that are in no bin yet into theirs."""
        new = len(tree) - self._placed
        self.regions = reserve(self.regions, new, new)
        rides_loop.note(self.regions, self._yields, self._rides, self._riding, tree.columns, self._placed, len(tree),
                        self._size, self._limits)
        self._placed = len(tree)

    def _add_rides(self, count: int) -> None:
        missing = count - len(self._rides)
        if missing > 0:
            self._rides = np.vstack([self._rides, np.zeros((missing, 10), np.int64)])
            self._actions = np.vstack([self._actions, np.empty((missing, self._actions.shape[1]))])
