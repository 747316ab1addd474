"""Which states of a plan see each other, and the shortest way along these lines of sight, in compiled code."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, BoolArray, IndexArray

SAMPLES = 2
"""Places of a cell at least at which a line is looked at."""


@njit(error_model="numpy")
def _clear(points: Array, one: int, other: int, blocked: BoolArray, shape: IndexArray) -> bool:
    """Return whether the line from points[one] to points[other] runs through no blocked cell."""
    longest = 0.0
    for axis in range(points.shape[1]):
        longest = max(longest, abs(points[other, axis] - points[one, axis]))
    count = int(SAMPLES * longest) + 1
    for k in range(count):
        share, place = (k + 0.5) / count, 0
        for axis in range(points.shape[1]):
            at = points[one, axis] + share * (points[other, axis] - points[one, axis])
            place = place * shape[axis] + int(at)
        if blocked[place]:
            return False
    return True


@njit(error_model="numpy")
def shortest_way(points: Array, index: IndexArray, low: Array, high: Array, most: int, blocked: BoolArray,
             shape: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Return the shortest way from the first to the last of some states of a plan: along it, or straight.

    Args:
        points: The states in cells [M, D], in their order in the plan.
        index: Which states of the plan they are [M].
        low, high: How far a step leads at most, along each axis, in cells [D]; below 0 and above 0.
        most: The most steps of a straight part.
        blocked: Whether a cell is likely blocked, flat.
        shape: The number of cells along each axis [D].

    Returns:
        For each state the one before it on the shortest way to it [M], and the steps of the straight part between
        the two, or 0 where the way follows the plan [M].
    """
    count = len(index)
    length = np.zeros(count)
    before, straight = np.zeros(count, np.int64), np.zeros(count, np.int64)
    for j in range(1, count):
        before[j], length[j] = j - 1, length[j - 1] + index[j] - index[j - 1]
        for i in range(j - 1, -1, -1):
            needed = 0.0
            for axis in range(points.shape[1]):
                way = points[j, axis] - points[i, axis]
                needed = max(needed, way / high[axis], way / low[axis])
            steps = max(1, int(np.ceil(needed + 1e-9)))
            if steps > most or steps >= index[j] - index[i] or length[i] + steps >= length[j]:
                continue
            if _clear(points, i, j, blocked, shape):
                before[j], straight[j], length[j] = i, steps, length[i] + steps
    return before, straight
