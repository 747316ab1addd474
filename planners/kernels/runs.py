"""A least-count queue in one array: members sorted by decreasing count, raised in O(1).

A queue is a slice `entries[start : start + length]` of rows (member, count, run start), int32. Equal counts
form a run. A run's first position, relative to `start`, is written at the run's *last* row; the other rows
hold leftovers. The lowest run is the tail of the slice, so that a random member of it is one random number
away, and raising a member is one swap with the first of its run, which then is the end of the run before.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

MEMBER, COUNT, RUN = 0, 1, 2
Entries = NDArray[np.int32]


@njit(cache=True, inline="always")
def append(entries: Entries, start: int, length: int, member: int) -> None:
    """Write a member of count 0 behind the `length` members of the queue; there must be room."""
    row = start + length
    run = length
    if length > 0 and entries[row - 1, COUNT] == 0:
        run = entries[row - 1, RUN]
    entries[row, MEMBER] = member
    entries[row, COUNT] = 0
    entries[row, RUN] = run


@njit(cache=True, inline="always")
def choose(entries: Entries, start: int, length: int, uniform: float) -> int:
    """Return a random member of the lowest run, by a number uniform in [0, 1), and raise its count by one.

    Equals "remove it from the list of its count, append it to the list of the next" of [Matheron2020] Alg. 5,
    where removal puts the list's first element into the gap.
    """
    last = length - 1
    first = entries[start + last, RUN]
    chosen = start + first + int(uniform * (length - first))
    head = start + first
    member = entries[chosen, MEMBER]
    count = entries[chosen, COUNT] + 1
    entries[chosen, MEMBER] = entries[head, MEMBER]
    if first < last:
        entries[start + last, RUN] = first + 1
    run = first
    if first > 0 and entries[head - 1, COUNT] == count:
        run = entries[head - 1, RUN]
    entries[head, MEMBER] = member
    entries[head, COUNT] = count
    entries[head, RUN] = run
    return member
