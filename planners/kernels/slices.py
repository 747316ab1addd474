"""Growing lists in one array: a list is a slice of a power of two of rows.

A full slice moves to one of twice the size; the old one goes into a list of free slices, for another list.
"""

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.planners.kernels.runs import Members, Number

SMALLEST = 2  # log2 of the rows of a new slice
CLASSES = 32  # slice sizes 2**0 .. 2**31
USED, LARGEST = 0, 1  # places in `used`


@njit()
def take(pool: Members, free: NDArray[np.int32], used: NDArray[np.int64], size: Number) -> Number:
    """Return the first row of a slice of 2**size rows.

    Args:
        pool: The rows [R]; a free slice's first row is the next free slice of its size, or -1.
        free: First free slice of each size [CLASSES], -1 for none.
        used: Rows ever used, and log2 of the largest slice [2].
        size: log2 of the number of rows.
    """
    start: Number = np.int64(free[size])
    if start >= 0:
        free[size] = pool[start]
        return start
    start = used[USED]
    used[USED] += 1 << size
    used[LARGEST] = max(used[LARGEST], size)
    return start


@njit()
def double(pool: Members, free: NDArray[np.int32], used: NDArray[np.int64], start: Number, size: Number) -> Number:
    """Move a full slice of 2**size rows from `start` to one of twice the size; return where that begins."""
    moved: Number = take(pool, free, used, size + 1)
    for row in range(1 << size):
        pool[moved + row] = pool[start + row]
    pool[start] = free[size]
    free[size] = start
    return moved


def rows_needed(used: NDArray[np.int64], count: int) -> int:
    """Return how many rows of the pool are enough for `count` more elements, wherever they go.

    Each of them opens a slice, or doubles one: those that are full together have at most `used` rows.
    """
    doubled = min(4 * int(used[USED]), count << (int(used[LARGEST]) + 1))
    return int(used[USED]) + doubled + (4 << SMALLEST) * count
