"""Exact nearest neighbours among points that are only ever added.

The first n points are cut into segments whose sizes are the powers of two in the binary form of n, large ones
first (Bentley and Saxe 1980). Each segment of at least LEAF points is a k-d tree: an implicit one, the point
in the middle of a range is the median of the range along an axis that turns with the depth. A new point
rebuilds the segment that it completes, so that a point is rebuilt O(log n) times, and no order of insertion
degenerates the trees, as it does a k-d tree that grows at its leaves ([Matheron2020] A.3).
"""

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, IndexArray

Items = NDArray[np.int32]
LEAF = 32
DEPTH = 64


@njit()
def insert(points: Array, items: Items, size: int, item: int) -> int:
    """Add row `item` of points [N, F] as entry number `size` of items [R]; return the new size."""
    items[size] = item
    size += 1
    if size % LEAF == 0:
        _build(points, items, size - (size & -size), size)
    return size


@njit()
def nearest(points: Array, items: Items, size: int, targets: Array, found: IndexArray) -> None:
    """Write into found [B] the items whose points are nearest to targets [B, F], of `size` > 0 items."""
    stack = np.empty((DEPTH, 3), np.int64)
    gaps = np.empty(DEPTH)
    for row in range(len(targets)):
        best, best_squared = -1, np.inf
        first, rest = 0, size - size % LEAF
        while rest > 0:
            segment = _highest_bit(rest)
            best, best_squared = _search(points, items, first, first + segment, targets, row, best,
                                         best_squared, stack, gaps)
            first += segment
            rest -= segment
        best, best_squared = _scan(points, items, first, size, targets, row, best, best_squared)
        found[row] = best


@njit()
def _highest_bit(number: int) -> int:
    bit = 1
    while 2 * bit <= number:
        bit *= 2
    return bit


@njit(inline="always")
def _scan(points: Array, items: Items, low: int, high: int, targets: Array, row: int,
          best: int, best_squared: float) -> tuple[int, float]:
    for place in range(low, high):
        squared = 0.0
        for axis in range(points.shape[1]):
            gap = points[items[place], axis] - targets[row, axis]
            squared += gap * gap
        if squared < best_squared or best < 0:
            best, best_squared = items[place], squared
    return best, best_squared


@njit()
def _search(points: Array, items: Items, low: int, high: int, targets: Array, row: int,
            best: int, best_squared: float, stack: IndexArray, gaps: Array) -> tuple[int, float]:
    """Search one k-d tree; keep on the stack the farther halves with the squared gap to their plane."""
    axes = points.shape[1]
    stack[0, 0], stack[0, 1], stack[0, 2] = low, high, 0
    gaps[0] = 0.0
    top = 1
    while top > 0:
        top -= 1
        low, high, axis = stack[top, 0], stack[top, 1], stack[top, 2]
        if gaps[top] >= best_squared:
            continue
        while high - low > LEAF:
            middle = (low + high) // 2
            best, best_squared = _scan(points, items, middle, middle + 1, targets, row, best, best_squared)
            gap = targets[row, axis] - points[items[middle], axis]
            axis = axis + 1 if axis + 1 < axes else 0
            stack[top, 2] = axis
            gaps[top] = gap * gap
            if gap < 0.0:
                stack[top, 0], stack[top, 1] = middle + 1, high
                high = middle
            else:
                stack[top, 0], stack[top, 1] = low, middle
                low = middle + 1
            top += 1
        best, best_squared = _scan(points, items, low, high, targets, row, best, best_squared)
    return best, best_squared


@njit()
def _build(points: Array, items: Items, low: int, high: int) -> None:
    """Arrange items[low:high] as an implicit k-d tree, each range around the median of its axis."""
    stack = np.empty((DEPTH, 3), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2] = low, high, 0
    top = 1
    while top > 0:
        top -= 1
        low, high, axis = stack[top, 0], stack[top, 1], stack[top, 2]
        while high - low > LEAF:
            middle = (low + high) // 2
            _place_median(points, items, low, high, middle, axis)
            axis = axis + 1 if axis + 1 < points.shape[1] else 0
            stack[top, 0], stack[top, 1], stack[top, 2] = middle + 1, high, axis
            top += 1
            high = middle


@njit()
def _place_median(points: Array, items: Items, low: int, high: int, middle: int, axis: int) -> None:
    """Move the item that belongs at `middle` there, smaller ones before it, larger ones behind (Hoare)."""
    last = high - 1
    while low < last:
        pivot = points[items[(low + last) // 2], axis]
        i, j = low, last
        while i <= j:
            while points[items[i], axis] < pivot:
                i += 1
            while points[items[j], axis] > pivot:
                j -= 1
            if i <= j:
                items[i], items[j] = items[j], items[i]
                i += 1
                j -= 1
        if middle <= j:
            last = j
        elif middle >= i:
            low = i
        else:
            return
