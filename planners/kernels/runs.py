"""A least-count queue: members sorted by decreasing count, raised in O(1), four bytes each.

A queue is a slice of an array of members. Equal counts form a run. The lowest run is the tail of the slice; where it
begins and its count stand in the queue's head, with the count of the next higher run and its row in `runs`, where its
beginning stands, and so on. All changes are made to the lowest run and the one above it: a random member of the
lowest run is one random number away, and raising it is a swap with the first of its run, which then is the end of the
run above.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit

RUN = np.dtype([("first", np.int32), ("count", np.int32), ("higher", np.int32), ("higher_count", np.int32)])
"""A run: where it begins, its count, and the next higher run: its row, or -1, and its count."""
HEAD = np.dtype([*((name, np.int32) for name in RUN.names or ()), ("start", np.int32), ("length", np.int32),
                 ("size", np.int32), ("unused", np.int32)])
"""A queue: its lowest run, its first place among the members, its length; `size`, log2 of its space, is the
owner's."""
RUNS, FREE_RUN = 0, 1  # places of `totals`: runs ever used, and the first free one (the next is its `higher`), or -1
Rows = NDArray[np.int32]
Heads = NDArray[np.void]
"""Records of HEAD [Q]."""
Runs = NDArray[np.void]
"""Records of RUN [K]."""

Members = NDArray[np.int32]
Number = int | np.integer[Any]


@njit(inline="always")
def append(members: Members, heads: Heads, runs: Runs, totals: NDArray[np.int64], queue: Number,
           member: Number) -> None:
    """Write a member of count 0 behind those of the queue heads[queue]; there must be space, also for a run."""
    length = heads[queue].length
    if length == 0:
        heads[queue].first = heads[queue].count = 0
        heads[queue].higher = heads[queue].higher_count = -1
    elif heads[queue].count > 0:
        _put_above(heads, runs, totals, queue, heads[queue].count)
        heads[queue].first, heads[queue].count = length, 0
    members[heads[queue].start + length] = member
    heads[queue].length = length + 1


@njit(inline="always")
def choose(members: Members, heads: Heads, runs: Runs, totals: NDArray[np.int64], queue: Number,
           uniform: float) -> Number:
    """Return a random member of the lowest run, by a number uniform in [0, 1), and raise its count by one.

    Equals "remove it from the list of its count, append it to the list of the next" of [Matheron2020] Alg. 5,
    where removal puts the list's first element into the gap.
    """
    length, first = heads[queue].length, heads[queue].first
    place = heads[queue].start + first
    chosen = place + int(uniform * (length - first))
    member: Number = members[chosen]
    members[chosen] = members[place]
    members[place] = member
    raised, alone = heads[queue].count + 1, first + 1 == length
    if heads[queue].higher_count == raised:
        if alone:
            _put_down(heads, runs, totals, queue)
        else:
            heads[queue].first = first + 1
    elif alone:
        heads[queue].count = raised
    else:
        _put_above(heads, runs, totals, queue, raised)
        heads[queue].first = first + 1
    return member


@njit(inline="always")
def peek(heads: Heads, queue: Number, uniform: float, later: Number) -> Number:
    """Return where the member is that `choose` will most likely return, after `later` other choices in this queue."""
    length = heads[queue].length
    first = heads[queue].first + later
    if first >= length:
        first = 0
    place: Number = heads[queue].start + first + int(uniform * (length - first))
    return place


@njit(inline="always")
def _put_above(heads: Heads, runs: Runs, totals: NDArray[np.int64], queue: Number, count: Number) -> None:
    """Make a run of this count, which begins where the lowest does, the one above the lowest."""
    run = totals[FREE_RUN]
    if run >= 0:
        totals[FREE_RUN] = runs[run].higher
    else:
        run = totals[RUNS]
        totals[RUNS] = run + 1
    runs[run].first, runs[run].count = heads[queue].first, count
    runs[run].higher, runs[run].higher_count = heads[queue].higher, heads[queue].higher_count
    heads[queue].higher, heads[queue].higher_count = run, count


@njit(inline="always")
def _put_down(heads: Heads, runs: Runs, totals: NDArray[np.int64], queue: Number) -> None:
    """Make the run above the lowest one."""
    run = heads[queue].higher
    heads[queue].first, heads[queue].count = runs[run].first, runs[run].count
    heads[queue].higher, heads[queue].higher_count = runs[run].higher, runs[run].higher_count
    runs[run].higher = totals[FREE_RUN]
    totals[FREE_RUN] = run
