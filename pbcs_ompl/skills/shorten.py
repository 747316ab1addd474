"""Erase the detours of a plan before skills are trained along it."""

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, IndexArray


def shorten(model: ResettableModel, states: Array, gap: float) -> IndexArray:
    """Return the indices [M] of the shortest way along `states` [T+1, D] from the first to the last.

    The way may go on from a state to the next one, or hop to any later state within `gap`. Exploration returns to
    places where it was before, and a hop leaves such a loop out; skills need states to start from, not controls
    between them, so a hop need not be a transition. With `gap` no larger than the activation radius, a hop is no
    longer than the distance at which skills hand over anyway.

    Source: dynamic programming over the indices, O(T^2) distances, T at a time. Not in [Matheron2020].
    """
    last = len(states) - 1
    hops = np.full(last + 1, np.iinfo(np.int64).max)
    before = np.arange(-1, last)
    hops[0] = 0
    for index in range(last):
        near = model.distance(states[index + 1:], states[index]) <= gap
        near[0] = True
        better = index + 1 + np.flatnonzero(near & (hops[index + 1:] > hops[index] + 1))
        hops[better] = hops[index] + 1
        before[better] = index
    return _backtrack(before, last)


def _backtrack(before: IndexArray, last: int) -> IndexArray:
    way = [last]
    while way[-1] > 0:
        way.append(int(before[way[-1]]))
    return np.array(way[::-1], dtype=np.int64)
