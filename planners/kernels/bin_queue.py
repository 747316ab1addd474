"""The memory of Ex: bins, their nodes, and how often each was expanded, with O(1) insertion and selection.

Differs from [Matheron2020] Alg. 5: the hash tables W_b, B_s, B_m of lists become sorted slices of two arrays
(see `runs`), one for the bins and one pool for the nodes of all bins (see `slices`). No kernel checks for space:
`reserve` makes it in advance.
"""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, resized_copy
from pbcs_ompl.planners.kernels.cells import cell_of, find_cell, rehash
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.runs import LENGTH, LOWEST, SIZE, START, Number, append, choose
from pbcs_ompl.planners.kernels.slices import CLASSES, SMALLEST, double, rows_needed, take


class BinQueue(NamedTuple):
    """The arrays. R rows of the pool, M rows for bins, F features, H hash cells (a power of two)."""

    pool: NDArray[np.int32]
    """Node queues of all bins [R, 3]."""
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
    """Pool rows ever used, and log2 of the largest slice [2]."""

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
    bins, rows = 1 << 10, 1 << 14
    return BinQueue(
        pool=np.empty((rows, 3), np.int32), heads=np.empty((bins, 4), np.int32),
        order=np.empty((bins, 3), np.int32), head=np.zeros((1, 4), np.int32),
        cells=np.empty((bins, num_features), np.int64), table=np.zeros(4 * bins, np.int32),
        free=np.full(CLASSES, -1, np.int32), used=np.zeros(2, np.int64))


def insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_], size: NDArray[np.float64],
           first: int) -> BinQueue:
    """Insert nodes first, first + 1, ... of features [B, F] except those of `skip` [B]; return the queue.

    Arrays that were too small are replaced; the queue that was passed is not to be used any more.
    """
    queue = reserve(queue, len(features))
    _insert(queue, features, skip, size, first)
    return queue


def reserve(queue: BinQueue, count: int) -> BinQueue:
    """Return the queue with space for `count` more nodes, whichever bins they are in; space costs no memory."""
    bins = queue.num_bins
    if bins + count > len(queue.heads):
        most = max(GROWTH * len(queue.heads), bins + count)
        table = np.zeros(4 << (most - 1).bit_length(), np.int32)
        cells = resized_copy(queue.cells, bins, most)
        rehash(cells, table, bins)
        queue = queue._replace(heads=resized_copy(queue.heads, bins, most), cells=cells, table=table,
                               order=resized_copy(queue.order, bins, most))
    rows = rows_needed(queue.used, count)
    if rows > len(queue.pool):
        queue = queue._replace(pool=resized_copy(queue.pool, int(queue.used[0]), max(GROWTH * len(queue.pool), rows)))
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


@njit(inline="always")
def add(pool: NDArray[np.int32], heads: NDArray[np.int32], number: Number, node: Number) -> bool:
    """Add a node of count 0 to a bin; return False where the bin is full, or there is none (number -1)."""
    if number < 0 or heads[number, LENGTH] == 1 << heads[number, SIZE]:
        return False
    append(pool, heads, number, node)
    return True


@njit()
def grow_and_add(queue: BinQueue, cell: NDArray[np.int64], place: Number, node: Number) -> None:
    """Add a node where `add` could not: open its bin, or double it."""
    pool, heads, free, used = queue.pool, queue.heads, queue.free, queue.used
    number: Number = np.int64(queue.table[place]) - 1
    if number < 0:
        number = _new_bin(queue, cell, place)
    else:
        size = np.int64(heads[number, SIZE])
        heads[number, START], heads[number, SIZE] = double(pool, free, used, heads[number, START], size), size + 1
    append(pool, heads, number, node)


@njit()
def _insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_],
            size: NDArray[np.float64], first: int) -> None:
    queue = uncounted(queue)
    pool, heads, cells, table = queue.pool, queue.heads, queue.cells, queue.table
    cell = np.empty(features.shape[1], np.int64)
    for row in range(len(features)):
        if not skip[row]:
            cell_of(features, row, size, cell)
            place = find_cell(cells, table, cell)
            if not add(pool, heads, table[place] - 1, first + row):
                grow_and_add(queue, cell, place, first + row)


@njit()
def _new_bin(queue: BinQueue, cell: NDArray[np.int64], place: Number) -> Number:
    """Open a bin at a place of the hash table."""
    number: Number = np.int64(queue.head[0, LENGTH])
    heads, cells = queue.heads, queue.cells
    heads[number, START] = take(queue.pool, queue.free, queue.used, SMALLEST)
    heads[number, LENGTH], heads[number, SIZE] = 0, SMALLEST
    for axis in range(len(cell)):
        cells[number, axis] = cell[axis]
    queue.table[place] = number + 1
    append(queue.order, queue.head, 0, number)
    return number
