"""A least-count queue in one array: members sorted by decreasing count, raised in O(1).

A queue is a slice of rows (member, count, run start), int32, of an array `entries`. Equal counts form a run;
the lowest run is the tail of the slice. The first position of the lowest run stands in the queue's head, that
of every other run at the run's *last* row; what the other rows hold there means nothing. So a random member
of the lowest run is one random number away, and raising a member is one swap with the first of its run, which
then is the end of the run before.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit

MEMBER, COUNT, RUN = 0, 1, 2  # columns of `entries`
START, LENGTH, LOWEST, SIZE = 0, 1, 2, 3  # columns of `heads`; SIZE (log2 of the space) is for the owner
Rows = NDArray[np.int32]
Number = int | np.integer[Any]


@njit(inline="always")
def append(entries: Rows, heads: Rows, queue: Number, member: Number) -> None:
    """Write a member of count 0 behind those of the queue heads[queue]; there must be space."""
    length = heads[queue, LENGTH]
    row = heads[queue, START] + length
    if length == 0:
        heads[queue, LOWEST] = 0
    elif entries[row - 1, COUNT] > 0:
        entries[row - 1, RUN] = heads[queue, LOWEST]
        heads[queue, LOWEST] = length
    entries[row, MEMBER] = member
    entries[row, COUNT] = 0
    heads[queue, LENGTH] = length + 1


@njit(inline="always")
def choose(entries: Rows, heads: Rows, queue: Number, uniform: float) -> Number:
    """Return a random member of the lowest run, by a number uniform in [0, 1), and raise its count by one.

    Equals "remove it from the list of its count, append it to the list of the next" of [Matheron2020] Alg. 5,
    where removal puts the list's first element into the gap.
    """
    length, first = heads[queue, LENGTH], heads[queue, LOWEST]
    head = heads[queue, START] + first
    chosen = head + int(uniform * (length - first))
    member: Number = entries[chosen, MEMBER]
    count = entries[head, COUNT] + 1
    entries[chosen, MEMBER] = entries[head, MEMBER]
    run = first
    if first > 0 and entries[head - 1, COUNT] == count:
        run = entries[head - 1, RUN]
    entries[head, MEMBER] = member
    entries[head, COUNT] = count
    entries[head, RUN] = run
    heads[queue, LOWEST] = first + 1 if first + 1 < length else run
    return member


@njit(inline="always")
def peek(heads: Rows, queue: Number, uniform: float) -> Number:
    """Return the row of the member that `choose` would return."""
    length, first = heads[queue, LENGTH], heads[queue, LOWEST]
    row: Number = heads[queue, START] + first + int(uniform * (length - first))
    return row
