"""Regions in order of a key that only ever rises, for each scale: a random one of the lowest key in O(1).

The regions of a scale lie in one row of `order`, by decreasing key. Regions of equal keys are a run; runs know the
next higher and the next lower one. To raise a region, the first of its run takes its place and it becomes the first,
which is the end of the run above: where that run's key is lower than the new one, its first region moves to its end,
and so on. That takes a step for each run that is passed, and all steps together are no more than all keys.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.planners.kernels.runs import Number, Rows

REGION = np.dtype([(name, np.int32) for name in ("parent", "child", "sibling", "count", "missing", "place", "run",
                                                 "start", "length", "size")])
"""What is known of a region: its place in a row of `order`, its run; for the rest see `regions`."""
RUN = np.dtype([(name, np.int32) for name in ("key", "first", "end", "higher", "lower")])
"""A run: its key (of a free one, the next free run, or -1), its places, the runs next to it, or -1."""
REGIONS, RUNS, FREE_RUN = range(3)  # places of `totals`: regions and runs ever used, the first free run
LOWEST, MEMBERS = 0, 1  # columns of `tails`, of each scale


@njit(inline="always")
def lowest(order: Rows, runs: Any, tails: Rows, scale: Number, uniform: float) -> Number:
    """Return a random region of the lowest key at a scale, by a number uniform in [0, 1)."""
    run = tails[scale, LOWEST]
    first = runs[run].first
    region: Number = order[scale, first + int(uniform * (runs[run].end - first))]
    return region


@njit(inline="always")
def enter(order: Rows, runs: Any, tails: Rows, totals: NDArray[np.int64], rows: Any, scale: Number,
          region: Number) -> None:
    """Add a region with key 0."""
    run, place = tails[scale, LOWEST], tails[scale, MEMBERS]
    if run < 0 or runs[run].key > 0:
        run = _new_run(runs, tails, totals, scale, 0, place, run, -1)
    order[scale, place] = region
    rows[region].place, rows[region].run = place, run
    runs[run].end = place + 1
    tails[scale, MEMBERS] = place + 1


@njit(forceinline=True)  # by LLVM: Numba takes a second longer for its three calls
def lift(order: Rows, runs: Any, tails: Rows, totals: NDArray[np.int64], rows: Any, scale: Number,
         region: Number, key: Number) -> None:
    """Give a region a higher key."""
    run = rows[region].run
    place = runs[run].first
    _move(order, rows, scale, place, rows[region].place)
    runs[run].first = place + 1
    above, below = runs[run].higher, run
    if place + 1 == runs[run].end:
        below = runs[run].lower
        _drop_run(runs, tails, totals, scale, run)
    while above >= 0 and runs[above].key < key:
        first = runs[above].first
        _move(order, rows, scale, first, place)
        runs[above].first = first + 1
        runs[above].end = place + 1
        place, below, above = first, above, runs[above].higher
    if above < 0 or runs[above].key > key:
        above = _new_run(runs, tails, totals, scale, key, place, above, below)
    runs[above].end = place + 1
    order[scale, place] = region
    rows[region].place, rows[region].run = place, above


@njit(inline="always")
def _move(order: Rows, rows: Any, scale: Number, start: Number, end: Number) -> None:
    region = order[scale, start]
    order[scale, end] = region
    rows[region].place = end


@njit(inline="always")
def _new_run(runs: Any, tails: Rows, totals: NDArray[np.int64], scale: Number, key: Number, place: Number,
             above: Number, below: Number) -> Number:
    run = totals[FREE_RUN]
    if run >= 0:
        totals[FREE_RUN] = runs[run].key
    else:
        run = totals[RUNS]
        totals[RUNS] = run + 1
    runs[run].key, runs[run].first, runs[run].higher, runs[run].lower = key, place, above, below
    if above >= 0:
        runs[above].lower = run
    if below >= 0:
        runs[below].higher = run
    else:
        tails[scale, LOWEST] = run
    number: Number = run
    return number


@njit(inline="always")
def _drop_run(runs: Any, tails: Rows, totals: NDArray[np.int64], scale: Number, run: Number) -> None:
    above, below = runs[run].higher, runs[run].lower
    if above >= 0:
        runs[above].lower = below
    if below >= 0:
        runs[below].higher = above
    else:
        tails[scale, LOWEST] = above
    runs[run].key = totals[FREE_RUN]
    totals[FREE_RUN] = run
