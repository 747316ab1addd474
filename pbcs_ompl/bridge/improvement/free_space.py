"""Where moves are likely free, by the transitions that were made: each cell is as what was seen nearest to it."""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.bridge.improvement.free_motion import FreeMotion
from pbcs_ompl.core.types import Array, BoolArray, IndexArray

EDGE = 0.5
"""Edge of a cell in steps."""
MOST_CELLS = 1 << 21
"""With more, cells are larger."""
CAUTION = 1.5
"""A cell is blocked where it is nearer to what was blocked than to what was free, times this."""
LONGEST = 60
"""Steps of a short cut."""


class ShortCut(NamedTuple):
    """A straight way from one state of a plan to a later one, and its steps."""

    first: int
    last: int
    steps: int


class FreeSpace:
    """Cells that were seen to be free or blocked, and short cuts of a plan that are likely free.

    Args:
        motion: How states change where nothing is in the way.
        states: States [N, D].
        controls: The controls [N, D] that were applied.
        after: What they led to [N, D].
    """

    def __init__(self, motion: FreeMotion, states: Array, controls: Array, after: Array):
        self._motion = motion
        aims = motion.predicted(states, controls)
        places = motion.in_steps(np.vstack([states, aims, after]))
        extent, edge = np.maximum(motion.high, -motion.low), EDGE
        low, size = places.min(axis=0), places.max(axis=0) - places.min(axis=0)
        while np.prod(size / (edge * extent) + 5.0) > MOST_CELLS:
            edge *= 1.5
        self._edges = edge * extent
        self._low = low - 2.0 * self._edges
        self._shape = np.ceil(size / self._edges).astype(np.int64) + 5
        self._free, self._blocked = (np.zeros(self._shape, np.bool_) for _ in range(2))
        self.note(states, controls, after)

    def note(self, states: Array, controls: Array, after: Array, *, certain: bool = False) -> None:
        """Take note of transitions from states [B, D]: those that led elsewhere than where they aimed were blocked.

        Args:
            states, controls, after: The transitions.
            certain: Whether what was blocked halfway counts as blocked, whatever else was free in its cell.
        """
        aims = self._motion.predicted(states, controls)
        free = self._motion.is_free(states, controls, after)
        middle = (states + aims) / 2.0
        self._free[self._cells(np.vstack([states, after, middle[free]]))] = True
        self._blocked[self._cells(np.vstack([middle[~free], aims[~free]]))] = True
        if certain:
            self._free[self._cells(middle[~free])] = False

    def short_cuts(self, states: Array, index: IndexArray) -> list[ShortCut]:
        """Return what makes a plan shortest that is left at, and joined at, some of its states only.

        Args:
            states: All states of the plan [T+1, D].
            index: These states, the first and the last among them, in their order [M].
        """
        from pbcs_ompl.bridge.improvement.sight import shortest_way  # compiled when it is imported

        points = (self._motion.in_steps(states[index]) - self._low) / self._edges
        before, straight = shortest_way(np.clip(points, 0.0, self._shape - 1e-6), index, self._motion.low / self._edges,
                                         self._motion.high / self._edges, LONGEST, self._likely_blocked().ravel(),
                                         self._shape)
        found, at = [], len(index) - 1
        while at > 0:
            if straight[at]:
                found.append(ShortCut(int(index[before[at]]), int(index[at]), int(straight[at])))
            at = int(before[at])
        return found

    def _likely_blocked(self) -> BoolArray:
        """Return which cells are nearer to what was blocked than to what was free."""
        from scipy.ndimage import distance_transform_cdt  # takes longer to load than most plans to improve

        blocked = self._blocked & ~self._free
        if not blocked.any():
            return blocked
        to_free, to_blocked = (np.asarray(distance_transform_cdt(~seen, metric="chessboard"))
                               for seen in (self._free, blocked))
        likely: BoolArray = to_blocked < CAUTION * to_free
        return likely

    def _cells(self, states: Array) -> tuple[IndexArray, ...]:
        """Return the cells of states [B, D] as an index; those outside are the last ones along an axis."""
        cells = np.floor((self._motion.in_steps(states) - self._low) / self._edges)
        return tuple(np.clip(cells, 0, self._shape - 1).astype(np.int64).T)
