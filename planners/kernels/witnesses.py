"""Witnesses: points that a search keeps apart, each with the cheapest node that has come close to it."""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, Columns, resized_copy
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE
from pbcs_ompl.planners.kernels.nearest import DEPTH, LEAF, insert, nearest
from pbcs_ompl.planners.kernels.runs import Number

WITNESSES = 0
"""The place of `totals`."""


class Witnesses(NamedTuple):
    """The arrays. M rows for witnesses, F features."""

    points: Array
    """Where each is [M, F], in bins."""
    items: NDArray[np.int32]
    """The k-d trees over them [M] (see `nearest`)."""
    nodes: NDArray[np.int32]
    """The node that each stands for [M]."""
    costs: NDArray[np.int32]
    """The steps from the start to that node [M]."""
    totals: IndexArray
    """How many witnesses there are [1]."""


WITNESSES_TYPE = types.NamedTuple((types.float64[:, ::1], types.int32[::1], types.int32[::1], types.int32[::1],
                                   types.int64[::1]), Witnesses)
"""Numba's type of Witnesses."""


def no_witnesses(features: int) -> Witnesses:
    """Return the arrays without witnesses, for points of F features."""
    rows = 1 << 10
    return Witnesses(np.empty((rows, features)), np.empty(rows, np.int32), np.empty(rows, np.int32),
                     np.empty(rows, np.int32), np.zeros(1, np.int64))


def reserve(witnesses: Witnesses, count: int) -> Witnesses:
    """Return the arrays with space for `count` more; those that were passed are not to be used any more."""
    used = int(witnesses.totals[WITNESSES])
    if used + count <= len(witnesses.items):
        return witnesses
    rows = max(GROWTH * len(witnesses.items), used + count)
    points, items, nodes, costs, totals = witnesses
    return Witnesses(resized_copy(points, used, rows), resized_copy(items, used, rows),
                     resized_copy(nodes, used, rows), resized_copy(costs, used, rows), totals)


@njit()
def note(witnesses: Witnesses, point: Array, found: IndexArray, node: Number, cost: Number, radius: float) -> bool:
    """Take note of a node; return whether its witness stands for it now.

    Args:
        witnesses: The witnesses, with space for one more.
        point: Where the node is [1, F], in bins.
        found: Space for one number.
        node, cost: The node, and the steps to it.
        radius: How far from its witness it may be; where it is farther, it becomes a witness.
    """
    points, items, nodes, costs, totals = witnesses
    number, apart = totals[WITNESSES], np.inf
    if number:
        nearest(points, items, number, point, found)
        apart = 0.0
        for axis in range(point.shape[1]):
            gap = points[found[0], axis] - point[0, axis]
            apart += gap * gap
    if apart > radius * radius:
        for axis in range(point.shape[1]):
            points[number, axis] = point[0, axis]
        nodes[number], costs[number] = node, cost
        totals[WITNESSES] = insert(points, items, number, number)
        return True
    if cost >= costs[found[0]]:
        return False
    nodes[found[0]], costs[found[0]] = node, cost
    return True


@njit(types.void(WITNESSES_TYPE, COLUMNS_TYPE, types.int64, types.float64[::1], types.float64, types.int64))
def note_tree(witnesses: Witnesses, columns: Columns, nodes: int, size: Array, radius: float, bound: int) -> None:
    """Take note of the first nodes of a tree that can be expanded, and are fewer than `bound` steps from a root.

    Args:
        witnesses: The witnesses, with space for as many.
        columns: The tree's arrays.
        nodes: How many.
        size: How long a bin is [F].
        radius: See `note`.
        bound: Steps.
    """
    steps, point, found = np.zeros(nodes, np.int64), np.empty((1, len(size))), np.empty(1, np.int64)
    for node in range(nodes):
        parent = np.int64(columns.parents[node])
        steps[node] = 0 if parent < 0 else steps[parent] + 1
        if columns.terminal[node] or steps[node] >= bound:
            continue
        for axis in range(len(size)):
            point[0, axis] = columns.features[node, axis] / size[axis]
        note(witnesses, point, found, node, steps[node], radius)


@njit()
def choose(witnesses: Witnesses, target: Array, radius: float, bound: Number) -> Number:
    """Return the cheapest witness within a radius of a target, the first of equals, or the nearest if none is within.

    Args:
        witnesses: The witnesses, of which one at least is cheap enough.
        target: A point [1, F], in bins.
        radius: In bins.
        bound: Steps; witnesses of as many, or of one less, are left out.
    """
    points, items, _, costs, totals = witnesses
    stack, gaps = np.empty((DEPTH, 3), np.int64), np.empty(DEPTH)
    best, within, squared = np.int64(-1), False, radius * radius
    limit = np.inf  # of the squared distance; once one is within, the radius
    first, rest = 0, totals[WITNESSES]
    while rest > 0:
        segment = LEAF
        while 2 * segment <= rest:
            segment *= 2
        segment = min(segment, rest)
        stack[0, 0], stack[0, 1], stack[0, 2] = first, first + segment, 0
        gaps[0], top = 0.0, 1
        while top > 0:
            top -= 1
            low, high, axis = stack[top, 0], stack[top, 1], stack[top, 2]
            if gaps[top] > limit:
                continue
            while True:
                leaf = high - low <= LEAF
                middle = low if leaf else (low + high) // 2
                for place in range(middle, high if leaf else middle + 1):
                    number = np.int64(items[place])
                    if costs[number] + 1 >= bound:
                        continue
                    apart = 0.0
                    for side in range(target.shape[1]):
                        gap = points[number, side] - target[0, side]
                        apart += gap * gap
                    if apart <= squared:
                        cheaper = costs[number] - costs[best] if within else -1
                        if cheaper < 0 or (cheaper == 0 and number < best):
                            best, within, limit = number, True, squared
                    elif apart < limit:
                        best, limit = number, apart
                if leaf:
                    break
                gap = target[0, axis] - points[items[middle], axis]
                axis = axis + 1 if axis + 1 < target.shape[1] else 0
                stack[top, 2], gaps[top] = axis, gap * gap
                if gap < 0.0:
                    stack[top, 0], stack[top, 1], high = middle + 1, high, middle
                else:
                    stack[top, 0], stack[top, 1], low = low, middle, middle + 1
                top += 1
        first += segment
        rest -= segment
    return best
