"""The memory of Ex: bins, their nodes, and how often each was expanded, with O(1) insertion and selection.

Differs from [Matheron2020] Alg. 5: the hash tables W_b, B_s, B_m of lists become sorted slices of two arrays
(see `runs`), one for the bins and one pool for the nodes of all bins. A bin's slice has space for a power of
two of rows; when it is full it moves to a slice of twice the size, and its old slice is put into a free list for
another bin.
"""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, resized_copy
from pbcs_ompl.planners.kernels.runs import LENGTH, LOWEST, MEMBER, SIZE, START, Number, append, choose

SMALLEST = 2  # log2 of the rows of a new bin's slice
CLASSES = 32  # slice sizes 2**0 .. 2**31
FARTHEST = 4.6e18  # cells beyond this coordinate are one cell: int64 ends there


class BinQueue(NamedTuple):
    """The arrays. R rows of the pool, M rows for bins, F features, H hash cells (a power of two)."""

    pool: NDArray[np.int32]
    """Node queues of all bins [R, 3]; a free slice's first row is the next free slice of its size, or -1."""
    heads: NDArray[np.int32]
    """The head of each bin's queue [M, 4]."""
    order: NDArray[np.int32]
    """The queue of the bins [M, 3]."""
    head: NDArray[np.int32]
    """Its head [1, 4]; its length is the number of bins."""
    cells: NDArray[np.int64]
    """Integer coordinates of each bin [M, F]."""
    table: NDArray[np.int32]
    """Hash table of bin numbers plus one, open addressing, 0 for empty [H]."""
    free: NDArray[np.int32]
    """First free slice of each size, -1 for none [CLASSES]."""
    used: NDArray[np.int64]
    """Pool rows ever used [1]."""

    @property
    def num_bins(self) -> int:
        """Number of bins."""
        return int(self.head[0, LENGTH])

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays; rows that were never written to are not counted."""
        by_bin = self.heads, self.order, self.cells
        return (self.pool[:self.used[0]].nbytes + sum(array[:self.num_bins].nbytes for array in by_bin)
                + self.table.nbytes + self.head.nbytes + self.free.nbytes + self.used.nbytes)


_integers = types.int64[:, ::1]
_entries = types.int32[:, ::1]
QUEUE_TYPE = types.NamedTuple((_entries, _entries, _entries, _entries, _integers, types.int32[::1],
                               types.int32[::1], types.int64[::1]), BinQueue)
"""Numba's type of BinQueue."""


def empty_queue(num_features: int) -> BinQueue:
    """Return a queue without bins; its rows cost no memory until they are written to."""
    bins, rows = 1 << 14, 1 << 16
    return BinQueue(
        pool=np.empty((rows, 3), np.int32), heads=np.empty((bins, 4), np.int32),
        order=np.empty((bins, 3), np.int32), head=np.zeros((1, 4), np.int32),
        cells=np.empty((bins, num_features), np.int64), table=np.zeros(4 * bins, np.int32),
        free=np.full(CLASSES, -1, np.int32), used=np.zeros(1, np.int64))


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


@njit()
def select(queue: BinQueue, uniforms: NDArray[np.float64], nodes: NDArray[np.int64]) -> None:
    """Write into `nodes` [B] as many selections in a row, by numbers uniform in [0, 1) [B, 2]: bin, node."""
    pool, heads, order, head = queue.pool, queue.heads, queue.order, queue.head
    for i in range(len(nodes)):
        nodes[i] = choose(pool, heads, choose(order, head, 0, uniforms[i, 0]), uniforms[i, 1])


def tied_bins(queue: BinQueue) -> int:
    """Return how many bins share the lowest count."""
    return int(queue.head[0, LENGTH] - queue.head[0, LOWEST])


@njit()
def cell_of(features: NDArray[np.float64], row: int, size: NDArray[np.float64],
            cell: NDArray[np.int64]) -> None:
    """Write the coordinates floor(feature / size) of features[row] into `cell` [F]."""
    for axis in range(len(cell)):
        cell[axis] = int(min(max(np.floor(features[row, axis] / size[axis]), -FARTHEST), FARTHEST))


@njit(inline="always")
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


@njit(inline="always")
def add(pool: NDArray[np.int32], heads: NDArray[np.int32], number: Number, node: Number) -> bool:
    """Add a node of count 0 to a bin; return False where the bin is full, or there is none (number -1)."""
    if number < 0 or heads[number, LENGTH] == 1 << heads[number, SIZE]:
        return False
    append(pool, heads, number, node)
    return True


@njit()
def grow_and_add(queue: BinQueue, cell: NDArray[np.int64], place: Number, node: Number) -> bool:
    """Add a node where `add` could not: open its bin, or double it. Return False where an array is full."""
    number: Number = np.int64(queue.table[place]) - 1
    if number < 0:
        number = _new_bin(queue, cell, place)
        if number < 0:
            return False
    elif not _double(queue, number):
        return False
    return add(queue.pool, queue.heads, number, node)


@njit()
def _insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_],
            size: NDArray[np.float64], first: int, done: int) -> int:
    """Insert from position `done` on; return where an array was full."""
    pool, heads, cells, table = queue.pool, queue.heads, queue.cells, queue.table
    cell = np.empty(features.shape[1], np.int64)
    while done < len(features):
        if not skip[done]:
            cell_of(features, done, size, cell)
            place = find_cell(cells, table, cell)
            if not (add(pool, heads, table[place] - 1, first + done)
                    or grow_and_add(queue, cell, place, first + done)):
                return done
        done += 1
    return done


@njit()
def _new_bin(queue: BinQueue, cell: NDArray[np.int64], place: Number) -> Number:
    """Open a bin at a place of the hash table; return -1 if there is no space for one."""
    number = np.int64(queue.head[0, LENGTH])
    if number == len(queue.heads):
        return -1
    start = _take(queue.pool, queue.free, queue.used, SMALLEST)
    if start < 0:
        return -1
    heads, cells = queue.heads, queue.cells
    heads[number, START], heads[number, LENGTH], heads[number, SIZE] = start, 0, SMALLEST
    for axis in range(len(cell)):
        cells[number, axis] = cell[axis]
    queue.table[place] = number + 1
    append(queue.order, queue.head, 0, number)
    return number


@njit()
def _double(queue: BinQueue, number: Number) -> bool:
    """Move a full bin to a slice of twice the size; return whether there was space."""
    pool, heads, free = queue.pool, queue.heads, queue.free
    start, length, size = heads[number, START], heads[number, LENGTH], np.int64(heads[number, SIZE])
    moved = _take(pool, free, queue.used, size + 1)
    if moved < 0:
        return False
    for row in range(length):
        for column in range(3):
            pool[moved + row, column] = pool[start + row, column]
    pool[start, MEMBER] = free[size]
    free[size] = start
    heads[number, START], heads[number, SIZE] = moved, size + 1
    return True


@njit()
def _take(pool: NDArray[np.int32], free: NDArray[np.int32], used: NDArray[np.int64], size: Number) -> Number:
    """Return the first row of a slice of 2**size rows, or -1."""
    start: Number = np.int64(free[size])
    if start >= 0:
        free[size] = pool[start, MEMBER]
        return start
    start = used[0]
    if start + (1 << size) > len(pool):
        return -1
    used[0] += 1 << size
    return start


def _grow(queue: BinQueue) -> BinQueue:
    """Return a queue with more space of each kind that is short."""
    bins = queue.num_bins
    if bins == len(queue.heads):
        most = GROWTH * bins
        table = np.zeros(4 * most, np.int32)
        cells = resized_copy(queue.cells, bins, most)
        _rehash(cells, table, bins)
        return queue._replace(heads=resized_copy(queue.heads, bins, most), cells=cells, table=table,
                              order=resized_copy(queue.order, bins, most))
    rows = int(queue.used[0])
    largest = 1 << (int(queue.heads[:bins, SIZE].max(initial=SMALLEST)) + 1)
    return queue._replace(pool=resized_copy(queue.pool, rows, max(GROWTH * len(queue.pool), rows + largest)))


@njit()
def _rehash(cells: NDArray[np.int64], table: NDArray[np.int32], bins: int) -> None:
    for number in range(bins):
        table[find_cell(cells, table, cells[number])] = number + 1
