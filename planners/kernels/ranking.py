"""Regions in order of a key that only ever rises, for each scale: a random one of the lowest key in O(1).

The regions of a scale lie in one row of `order`, by decreasing key. Regions of equal keys are a run; runs know the
next higher and the next lower one. To raise a region, the first of its run takes its place and it becomes the first,
which is the end of the run above: where that run's key is lower than the new one, its first region moves to its end,
and so on. That takes a step for each run that is passed, and all steps together are no more than all keys.
"""

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.planners.kernels.runs import Number, Rows

PARENT, CHILD, SIBLING, COUNT, MISSING, PLACE, RUN, START, LENGTH, SIZE = range(10)  # columns of `rows`
KEY, FIRST, END, HIGHER, LOWER = range(5)  # columns of `runs`; a free run's KEY is the next free run, or -1
REGIONS, RUNS, FREE_RUN = range(3)  # places of `totals`: regions and runs ever used, the first free run
LOWEST, MEMBERS = 0, 1  # columns of `tails`, of each scale


@njit(inline="always")
def lowest(order: Rows, runs: Rows, tails: Rows, scale: Number, uniform: float) -> Number:
    """Return a random region of the lowest key at a scale, by a number uniform in [0, 1)."""
    run = tails[scale, LOWEST]
    first = runs[run, FIRST]
    region: Number = order[scale, first + int(uniform * (runs[run, END] - first))]
    return region


@njit(inline="always")
def enter(order: Rows, runs: Rows, tails: Rows, totals: NDArray[np.int64], rows: Rows, scale: Number,
          region: Number) -> None:
    """Add a region with key 0."""
    run, place = tails[scale, LOWEST], tails[scale, MEMBERS]
    if run < 0 or runs[run, KEY] > 0:
        run = _new_run(runs, tails, totals, scale, 0, place, run, -1)
    order[scale, place] = region
    rows[region, PLACE], rows[region, RUN] = place, run
    runs[run, END] = place + 1
    tails[scale, MEMBERS] = place + 1


@njit(inline="always")
def lift(order: Rows, runs: Rows, tails: Rows, totals: NDArray[np.int64], rows: Rows, scale: Number,
         region: Number, key: Number) -> None:
    """Give a region a higher key."""
    run = rows[region, RUN]
    place = runs[run, FIRST]
    _move(order, rows, scale, place, rows[region, PLACE])
    runs[run, FIRST] = place + 1
    above, below = runs[run, HIGHER], run
    if place + 1 == runs[run, END]:
        below = runs[run, LOWER]
        _drop_run(runs, tails, totals, scale, run)
    while above >= 0 and runs[above, KEY] < key:
        first = runs[above, FIRST]
        _move(order, rows, scale, first, place)
        runs[above, FIRST] = first + 1
        runs[above, END] = place + 1
        place, below, above = first, above, runs[above, HIGHER]
    if above < 0 or runs[above, KEY] > key:
        above = _new_run(runs, tails, totals, scale, key, place, above, below)
    runs[above, END] = place + 1
    order[scale, place] = region
    rows[region, PLACE], rows[region, RUN] = place, above


@njit(inline="always")
def _move(order: Rows, rows: Rows, scale: Number, start: Number, end: Number) -> None:
    region = order[scale, start]
    order[scale, end] = region
    rows[region, PLACE] = end


@njit(inline="always")
def _new_run(runs: Rows, tails: Rows, totals: NDArray[np.int64], scale: Number, key: Number, place: Number,
             above: Number, below: Number) -> Number:
    run = totals[FREE_RUN]
    if run >= 0:
        totals[FREE_RUN] = runs[run, KEY]
    else:
        run = totals[RUNS]
        totals[RUNS] = run + 1
    runs[run, KEY], runs[run, FIRST], runs[run, HIGHER], runs[run, LOWER] = key, place, above, below
    if above >= 0:
        runs[above, LOWER] = run
    if below >= 0:
        runs[below, HIGHER] = run
    else:
        tails[scale, LOWEST] = run
    number: Number = run
    return number


@njit(inline="always")
def _drop_run(runs: Rows, tails: Rows, totals: NDArray[np.int64], scale: Number, run: Number) -> None:
    above, below = runs[run, HIGHER], runs[run, LOWER]
    if above >= 0:
        runs[above, LOWER] = below
    if below >= 0:
        runs[below, HIGHER] = above
    else:
        tails[scale, LOWEST] = above
    runs[run, KEY] = totals[FREE_RUN]
    totals[FREE_RUN] = run
