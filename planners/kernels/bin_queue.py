"""The memory of Ex: bins, their nodes, and how often each was expanded, with O(1) insertion and selection.

Differs from [Matheron2020] Alg. 5: the hash tables W_b, B_s, B_m of lists become sorted slices of two arrays
(see `runs`), one for the bins and one pool for the nodes of all bins. A bin's slice has room for a power of
two of rows; when it is full it moves to a slice of twice the size, and its old slice waits in a free list for
another bin.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from planners.kernels.runs import MEMBER, RUN, append, choose

SMALLEST = 2  # log2 of the rows of a new bin's slice
CLASSES = 32  # slice sizes 2**0 .. 2**31
Number = int | np.int64  # what compiled functions return is one of them, depending on who calls
START, LENGTH, SIZE = 0, 1, 2  # columns of `slices`
BINS, POOL = 0, 1  # entries of `used`
GROWTH = 4  # of the arrays; rooms cost address space only
FARTHEST = 4.6e18  # cells beyond this coordinate are one cell: int64 ends there


class BinQueue(NamedTuple):
    """The arrays. R rows of the pool, M rooms for bins, F features, H hash cells (a power of two)."""

    pool: NDArray[np.int32]
    """Node queues of all bins [R, 3]; a free slice's first row is the next free slice of its size, or -1."""
    slices: NDArray[np.int32]
    """Of each bin: first row in the pool, length, log2 of the rows [M, 3]."""
    order: NDArray[np.int32]
    """The queue of the bins [M, 3]."""
    cells: NDArray[np.int64]
    """Integer coordinates of each bin [M, F]."""
    table: NDArray[np.int32]
    """Hash table of bin numbers plus one, open addressing, 0 for empty [H]."""
    free: NDArray[np.int32]
    """First free slice of each size, -1 for none [CLASSES]."""
    used: NDArray[np.int64]
    """Number of bins, and of pool rows ever given away [2]."""

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays; rooms that were never written to are not counted."""
        bins, rows = int(self.used[BINS]), int(self.used[POOL])
        return (self.pool[:rows].nbytes + self.slices[:bins].nbytes + self.order[:bins].nbytes
                + self.cells[:bins].nbytes + self.table.nbytes + self.free.nbytes + self.used.nbytes)


_integers = types.int64[:, ::1]
_entries = types.int32[:, ::1]
QUEUE_TYPE = types.NamedTuple((_entries, _entries, _entries, _integers, types.int32[::1], types.int32[::1],
                               types.int64[::1]), BinQueue)
"""Numba's type of BinQueue."""


def empty_queue(num_features: int) -> BinQueue:
    """Return a queue without bins; its rooms cost no memory until they are written to."""
    rooms, rows = 1 << 14, 1 << 16
    return BinQueue(
        pool=np.empty((rows, 3), np.int32), slices=np.empty((rooms, 3), np.int32),
        order=np.empty((rooms, 3), np.int32), cells=np.empty((rooms, num_features), np.int64),
        table=np.zeros(4 * rooms, np.int32), free=np.full(CLASSES, -1, np.int32), used=np.zeros(2, np.int64))


def insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_], size: NDArray[np.float64],
           first: int) -> BinQueue:
    """Insert nodes first, first + 1, ... of features [B, F] except those of `skip` [B]; return the queue.

    Arrays that were too small are replaced; the queue that was passed is not to be used any more.
    """
    done = _insert(queue, features, skip, size, first, 0)
    while done < len(features):
        queue = _grow(queue)
        done = _insert(queue, features, skip, size, first, done)
    return queue


@njit(cache=True)
def select(queue: BinQueue, uniforms: NDArray[np.float64], nodes: NDArray[np.int64]) -> None:
    """Write into `nodes` [B] as many selections in a row, by numbers uniform in [0, 1) [B, 2]: bin, node."""
    pool, slices, order, bins = queue.pool, queue.slices, queue.order, queue.used[BINS]
    for i in range(len(nodes)):
        number = choose(order, 0, bins, uniforms[i, 0])
        nodes[i] = choose(pool, slices[number, START], slices[number, LENGTH], uniforms[i, 1])


@njit(cache=True)
def tied_bins(queue: BinQueue) -> int:
    """Return how many bins share the lowest count."""
    bins = queue.used[BINS]
    return bins - queue.order[bins - 1, RUN]


@njit(cache=True)
def cell_of(features: NDArray[np.float64], row: int, size: NDArray[np.float64], cell: NDArray[np.int64]) -> None:
    """Write the coordinates floor(feature / size) of features[row] into `cell` [F]."""
    for axis in range(len(cell)):
        cell[axis] = int(min(max(np.floor(features[row, axis] / size[axis]), -FARTHEST), FARTHEST))


@njit(cache=True, inline="always")
def find_cell(cells: NDArray[np.int64], table: NDArray[np.int32], cell: NDArray[np.int64]) -> Number:
    """Return the position in `table` of a cell [F], or of the empty place where it belongs."""
    mixed = np.uint64(0)
    for axis in range(len(cell)):
        mixed = (mixed ^ np.uint64(cell[axis])) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    place = np.int64(mixed & np.uint64(len(table) - 1))
    while table[place] > 0:
        same = True
        for axis in range(len(cell)):
            same = same and cells[table[place] - 1, axis] == cell[axis]
        if same:
            return place
        place = (place + 1) & (len(table) - 1)
    return place


@njit(cache=True, inline="always")
def add(pool: NDArray[np.int32], slices: NDArray[np.int32], number: int, node: int) -> bool:
    """Add a node of count 0 to a bin; return False where the bin is full, or there is none (number -1)."""
    if number < 0:
        return False
    length = np.int64(slices[number, LENGTH])
    if length == 1 << slices[number, SIZE]:
        return False
    append(pool, slices[number, START], length, node)
    slices[number, LENGTH] = length + 1
    return True


@njit(cache=True)
def make_room_and_add(queue: BinQueue, cell: NDArray[np.int64], place: int, node: int) -> bool:
    """Add a node where `add` could not: open its bin, or double it. Return False where an array is full."""
    number = np.int64(queue.table[place]) - 1
    if number < 0:
        number = _new_bin(queue, cell, place)
        if number < 0:
            return False
    elif not _double(queue, number):
        return False
    return add(queue.pool, queue.slices, number, node)


@njit(cache=True)
def _insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_],
            size: NDArray[np.float64], first: int, done: int) -> int:
    """Insert from position `done` on; return where an array was full."""
    pool, slices, cells, table = queue.pool, queue.slices, queue.cells, queue.table
    cell = np.empty(features.shape[1], np.int64)
    while done < len(features):
        if not skip[done]:
            cell_of(features, done, size, cell)
            place = find_cell(cells, table, cell)
            if not (add(pool, slices, table[place] - 1, first + done)
                    or make_room_and_add(queue, cell, place, first + done)):
                return done
        done += 1
    return done


@njit(cache=True)
def _new_bin(queue: BinQueue, cell: NDArray[np.int64], place: int) -> Number:
    """Open a bin at a place of the hash table; return -1 if there is no room for one."""
    number = np.int64(queue.used[BINS])
    if number == len(queue.slices):
        return -1
    start = _take(queue.pool, queue.free, queue.used, SMALLEST)
    if start < 0:
        return -1
    slices, cells = queue.slices, queue.cells
    for axis in range(len(cell)):
        cells[number, axis] = cell[axis]
    slices[number, START], slices[number, LENGTH], slices[number, SIZE] = start, 0, SMALLEST
    queue.table[place] = number + 1
    append(queue.order, 0, number, number)
    queue.used[BINS] += 1
    return number


@njit(cache=True)
def _double(queue: BinQueue, number: int) -> bool:
    """Move a full bin to a slice of twice the size; return whether there was room."""
    pool, slices, free = queue.pool, queue.slices, queue.free
    start, length = np.int64(slices[number, START]), np.int64(slices[number, LENGTH])
    size = np.int64(slices[number, SIZE])
    moved = _take(pool, free, queue.used, size + 1)
    if moved < 0:
        return False
    for row in range(length):
        for column in range(3):
            pool[moved + row, column] = pool[start + row, column]
    pool[start, MEMBER] = free[size]
    free[size] = start
    slices[number, START], slices[number, SIZE] = moved, size + 1
    return True


@njit(cache=True)
def _take(pool: NDArray[np.int32], free: NDArray[np.int32], used: NDArray[np.int64], size: int) -> Number:
    """Return the first row of a slice of 2**size rows, or -1."""
    start = np.int64(free[size])
    if start >= 0:
        free[size] = pool[start, MEMBER]
        return start
    start = used[POOL]
    if start + (1 << size) > len(pool):
        return -1
    used[POOL] += 1 << size
    return start


def _grow(queue: BinQueue) -> BinQueue:
    """Return a queue with more room of each kind that is short."""
    bins = int(queue.used[BINS])
    if bins == len(queue.slices):
        rooms = GROWTH * bins
        table = np.zeros(4 * rooms, np.int32)
        cells = _enlarged(queue.cells, bins, rooms)
        _rehash(cells, table, bins)
        return queue._replace(slices=_enlarged(queue.slices, bins, rooms), cells=cells, table=table,
                              order=_enlarged(queue.order, bins, rooms))
    rows = int(queue.used[POOL])
    largest = 1 << (int(queue.slices[:bins, SIZE].max(initial=SMALLEST)) + 1)
    return queue._replace(pool=_enlarged(queue.pool, rows, max(GROWTH * len(queue.pool), rows + largest)))


def _enlarged(array: np.ndarray, used: int, rows: int) -> np.ndarray:
    larger = np.empty((rows, *array.shape[1:]), array.dtype)
    larger[:used] = array[:used]
    return larger


@njit(cache=True)
def _rehash(cells: NDArray[np.int64], table: NDArray[np.int32], bins: int) -> None:
    for number in range(bins):
        table[find_cell(cells, table, cells[number])] = number + 1
