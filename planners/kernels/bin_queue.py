"""The memory of Ex: bins, their nodes, and how often each was expanded, with O(1) insertion and selection.

Differs from [Matheron2020] Alg. 5: the hash tables W_b, B_s, B_m of lists become sorted slices of two arrays
(see `runs`), one for the bins and one pool for the nodes of all bins (see `slices`). No kernel checks for space:
`reserve` makes it in advance.
"""

from typing import NamedTuple

import numba
import numpy as np
from numba import types
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, resized_copy
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.kernels.cells import cell_of, find_cell, rehash
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.runs import (
    FREE_RUN,
    HEAD,
    RUN,
    RUNS,
    Heads,
    Members,
    Number,
    Runs,
    append,
    choose,
)
from pbcs_ompl.planners.kernels.slices import CLASSES, SMALLEST, double, rows_needed, take

RUNS_A_NODE = 4
"""The most new runs when a bin and a node of it are chosen, and a node and its bin are added."""


class BinQueue(NamedTuple):
    """The arrays. R rows of the pool, M rows for bins, F features, H hash cells (a power of two)."""

    pool: Members
    """Node queues of all bins [R]."""
    heads: Heads
    """The head of each bin's queue [M, 7]."""
    order: Members
    """The queue of the bins [M]."""
    head: Heads
    """Its head [1, 7]; its length is the number of bins."""
    runs: Runs
    """The runs of all queues but the lowest of each [K, 4]."""
    totals: NDArray[np.int64]
    """Runs ever used, and the first free one [2]."""
    cells: NDArray[np.int64]
    """Integer coordinates of each bin [M, F]."""
    table: NDArray[np.int32]
    """Hash table of bin numbers plus one, open addressing, 0 for empty [H]."""
    free: NDArray[np.int32]
    """First free slice of each size, -1 for none [CLASSES]."""
    used: NDArray[np.int64]
    """Pool rows ever used, and log2 of the largest slice [2]."""
    turns: IndexArray
    """Bins in a period of each feature [F]; 0 for a feature without."""

    @property
    def num_bins(self) -> int:
        """Number of bins."""
        return int(self.head['length'][0])

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays; rows that were never written to are not counted."""
        by_bin = self.heads, self.order, self.cells
        return (self.pool[:self.used[0]].nbytes + sum(array[:self.num_bins].nbytes for array in by_bin)
                + self.runs[:self.totals[RUNS]].nbytes + self.table.nbytes)


_integers = types.int64[:, ::1]
_entries = types.int32[:, ::1]
_vector = types.int32[::1]
_heads, _runs = (numba.from_dtype(kind)[::1] for kind in (HEAD, RUN))
_totals = types.int64[::1]
QUEUE_TYPE = types.NamedTuple((_vector, _heads, _vector, _heads, _runs, _totals, _integers, _vector, _vector,
                               _totals, _totals), BinQueue)
"""Numba's type of BinQueue."""


def empty_queue(num_features: int, turns: IndexArray | None = None) -> BinQueue:
    """Return a queue without bins, with `turns` bins in a period; its rows cost no memory until they are written to."""
    bins, rows, totals = 1 << 10, 1 << 14, np.zeros(2, np.int64)
    totals[FREE_RUN] = -1
    return BinQueue(
        pool=np.empty(rows, np.int32), heads=np.empty(bins, HEAD), order=np.empty(bins, np.int32),
        head=np.zeros(1, HEAD), runs=np.empty(rows, RUN), totals=totals,
        cells=np.empty((bins, num_features), np.int64), table=np.zeros(4 * bins, np.int32),
        free=np.full(CLASSES, -1, np.int32), used=np.zeros(2, np.int64),
        turns=np.zeros(num_features, np.int64) if turns is None else turns)


def insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_], size: NDArray[np.float64],
           first: int) -> BinQueue:
    """Insert nodes first, first + 1, ... of features [B, F] except those of `skip` [B]; return the queue.

    Arrays that were too small are replaced; the queue that was passed is not to be used any more.
    """
    queue = reserve(queue, len(features))
    _insert(queue, features, skip, size, first)
    return queue


def reserve(queue: BinQueue, count: int) -> BinQueue:
    """Return the queue with space for `count` more nodes and choices, whichever bins they are in."""
    bins = queue.num_bins
    if bins + count > len(queue.heads):
        most = max(GROWTH * len(queue.heads), bins + count)
        table = np.zeros(4 << (most - 1).bit_length(), np.int32)
        cells = resized_copy(queue.cells, bins, most)
        rehash(cells, table, bins)
        queue = queue._replace(heads=resized_copy(queue.heads, bins, most), cells=cells, table=table,
                               order=resized_copy(queue.order, bins, most))
    runs = int(queue.totals[RUNS]) + RUNS_A_NODE * count
    if runs > len(queue.runs):
        queue = queue._replace(runs=resized_copy(queue.runs, int(queue.totals[RUNS]),
                                                 max(GROWTH * len(queue.runs), runs)))
    rows = rows_needed(queue.used, count)
    if rows > len(queue.pool):
        queue = queue._replace(pool=resized_copy(queue.pool, int(queue.used[0]), max(GROWTH * len(queue.pool), rows)))
    return queue


def select(queue: BinQueue, uniforms: NDArray[np.float64], nodes: NDArray[np.int64]) -> BinQueue:
    """Write into `nodes` [B] as many selections in a row, by numbers uniform in [0, 1) [B, 2]: bin, node.

    Returns:
        The queue; that which was passed is not to be used any more.
    """
    queue = reserve(queue, len(nodes))
    _select(queue, uniforms, nodes)
    return queue


@njit()
def _select(queue: BinQueue, uniforms: NDArray[np.float64], nodes: NDArray[np.int64]) -> None:
    pool, heads, order, head, runs, totals = queue.pool, queue.heads, queue.order, queue.head, queue.runs, queue.totals
    for i in range(len(nodes)):
        number = choose(order, head, runs, totals, 0, uniforms[i, 0])
        nodes[i] = choose(pool, heads, runs, totals, number, uniforms[i, 1])


def tied_bins(queue: BinQueue) -> int:
    """Return how many bins share the lowest count."""
    return int(queue.head['length'][0] - queue.head['first'][0])


@njit(inline="always")
def add(pool: Members, heads: Heads, runs: Runs, totals: NDArray[np.int64], number: Number, node: Number) -> bool:
    """Add a node of count 0 to a bin; return False where the bin is full, or there is none (number -1)."""
    if number < 0 or heads[number].length == 1 << heads[number].size:
        return False
    append(pool, heads, runs, totals, number, node)
    return True


@njit(inline="always")
def grow_and_add(queue: BinQueue, cell: NDArray[np.int64], place: Number, node: Number) -> None:
    """Add a node where `add` could not: open its bin, or double it.

    Inlined: every third node or so comes here, and to hand over the arrays of a queue costs as much as a step of a
    point.
    """
    pool, heads, free, used = queue.pool, queue.heads, queue.free, queue.used
    number: Number = np.int64(queue.table[place]) - 1
    if number < 0:
        number = _new_bin(queue, cell, place)
    else:
        size = np.int64(heads[number].size)
        heads[number].start, heads[number].size = double(pool, free, used, heads[number].start, size), size + 1
    append(pool, heads, queue.runs, queue.totals, number, node)


@njit()
def _insert(queue: BinQueue, features: NDArray[np.float64], skip: NDArray[np.bool_],
            size: NDArray[np.float64], first: int) -> None:
    queue = uncounted(queue)
    pool, heads, cells, table = queue.pool, queue.heads, queue.cells, queue.table
    cell = np.empty(features.shape[1], np.int64)
    for row in range(len(features)):
        if not skip[row]:
            cell_of(features, row, size, queue.turns, cell)
            place = find_cell(cells, table, cell)
            if not add(pool, heads, queue.runs, queue.totals, table[place] - 1, first + row):
                grow_and_add(queue, cell, place, first + row)


@njit(inline="always")
def _new_bin(queue: BinQueue, cell: NDArray[np.int64], place: Number) -> Number:
    """Open a bin at a place of the hash table."""
    number: Number = np.int64(queue.head[0].length)
    heads, cells = queue.heads, queue.cells
    heads[number].start = take(queue.pool, queue.free, queue.used, SMALLEST)
    heads[number].length, heads[number].size = 0, SMALLEST
    for axis in range(len(cell)):
        cells[number, axis] = cell[axis]
    queue.table[place] = number + 1
    append(queue.order, queue.head, queue.runs, queue.totals, 0, number)
    return number
