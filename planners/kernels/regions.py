"""Bins and the regions around them at several scales, with the nodes of each bin: the memory of Rides.

A region of scale s is a cube of 2**s bins along each feature; the bins are the regions of scale 0. A region is open
once a node is in it. All open regions have a number; what is known of each is a row of `rows` (see `ranking`).
"""

from typing import Any, NamedTuple

import numba
import numpy as np
from numba import types
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, resized_copy
from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.planners.kernels.cells import find_cell, rehash, step_aside
from pbcs_ompl.planners.kernels.ranking import (
    FREE_RUN,
    LOWEST,
    REGION,
    REGIONS,
    RUN,
    RUNS,
    enter,
    lift,
)
from pbcs_ompl.planners.kernels.runs import Members, Number, Rows
from pbcs_ompl.planners.kernels.slices import CLASSES, SMALLEST, USED, double, rows_needed, take

SURROUNDED = 4
"""How many times a ride counts in a region all of whose neighbours are open."""


class Regions(NamedTuple):
    """The arrays. M rows for regions, S scales, F features, R rows of the pool, H hash cells (a power of two)."""

    rows: Any
    """What is known of each region [M]."""
    cells: NDArray[np.int64]
    """Integer coordinates of each region, and its scale [M, F + 1]."""
    table: NDArray[np.int32]
    """Hash table of region numbers plus one, open addressing, 0 for empty [H]."""
    order: Rows
    """The regions of each scale by decreasing key [S, M]."""
    runs: Any
    """Runs of equal keys [M]."""
    tails: Rows
    """The lowest run and the number of regions of each scale [S, 2]."""
    totals: NDArray[np.int64]
    """Regions and runs ever used, and the first free run [3]."""
    pool: Members
    """The nodes of all bins, in slices [R] (see `slices`)."""
    free: NDArray[np.int32]
    used: NDArray[np.int64]
    cell: NDArray[np.int64]
    """Where a cell is computed [F + 1]."""
    turns: IndexArray
    """Bins in a period of each feature [F]; 0 for a feature without."""

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays; rows that were never written to are not counted."""
        regions, runs = int(self.totals[REGIONS]), int(self.totals[RUNS])
        return int(self.rows[:regions].nbytes + self.cells[:regions].nbytes + self.table.nbytes + 4 * regions
                   + self.runs[:runs].nbytes + self.pool[:self.used[USED]].nbytes)


_rows = types.int32[:, ::1]
_regions, _runs = (numba.from_dtype(kind)[::1] for kind in (REGION, RUN))
REGIONS_TYPE = types.NamedTuple((_regions, types.int64[:, ::1], types.int32[::1], _rows, _runs, _rows, types.int64[::1],
                                 types.int32[::1], types.int32[::1], *3 * (types.int64[::1],)), Regions)
"""Numba's type of Regions."""


def no_regions(num_features: int, scales: int, turns: IndexArray | None = None) -> Regions:
    """Return the arrays without regions, with `turns` bins [F] in a period; rows not written to cost no memory."""
    most, pool = 1 << 12, 1 << 14
    tails = np.zeros((scales, 2), np.int32)
    tails[:, LOWEST] = -1
    totals = np.zeros(3, np.int64)
    totals[FREE_RUN] = -1
    return Regions(
        rows=np.empty(most, REGION), cells=np.empty((most, 1 + num_features), np.int64),
        table=_table(most), order=np.empty((scales, most), np.int32),
        runs=np.empty(most, RUN), tails=tails, totals=totals, pool=np.empty(pool, np.int32),
        free=np.full(CLASSES, -1, np.int32), used=np.zeros(2, np.int64),
        cell=np.zeros(1 + num_features, np.int64), turns=np.zeros(num_features, np.int64) if turns is None else turns)


def reserve(regions: Regions, nodes: int, bins: int) -> Regions:
    """Return the regions with space for more nodes; those that were passed are not to be used any more.

    Args:
        regions: The regions.
        nodes: How many nodes are to come.
        bins: How many of them may open a bin.
    """
    known, scales, size = int(regions.totals[REGIONS]), len(regions.order), len(regions.rows)
    if known + scales * bins > size:
        size = max(GROWTH * size, known + scales * bins)
        cells, table = resized_copy(regions.cells, known, size), _table(size)
        rehash(cells, table, known)
        order = np.empty((scales, size), np.int32)
        order[:, :known] = regions.order[:, :known]
        regions = regions._replace(rows=resized_copy(regions.rows, known, size), cells=cells, table=table, order=order,
                                   runs=resized_copy(regions.runs, int(regions.totals[RUNS]), size))
    rows = rows_needed(regions.used, nodes)
    if rows > len(regions.pool):
        regions = regions._replace(pool=resized_copy(regions.pool, int(regions.used[USED]),
                                                     max(GROWTH * len(regions.pool), rows)))
    return regions


def _table(regions: int) -> NDArray[np.int32]:
    """Return an empty hash table, at least half of which stays empty."""
    return np.zeros(2 << (regions - 1).bit_length(), np.int32)


@njit(inline="always")
def key_of(rows: Any, region: Number) -> Number:
    """Return by what regions are ranked: the rides begun in it, several times as many once it is surrounded."""
    count: Number = rows[region].count
    return count if rows[region].missing > 0 else SURROUNDED * (count + 1)


@njit(inline="always")
def add_node(rows: Any, pool: Members, free: NDArray[np.int32], used: NDArray[np.int64], number: Number,
             node: Number) -> None:
    """Add a node to a bin."""
    length = np.int64(rows[number].length)
    if length == 1 << rows[number].size:
        size = np.int64(rows[number].size)
        rows[number].start, rows[number].size = double(pool, free, used, rows[number].start, size), size + 1
    pool[rows[number].start + length] = node
    rows[number].length = length + 1


@njit(inline="always")
def open_bin(regions: Regions, cell: NDArray[np.int64]) -> Number:
    """Open the bin of `cell` [F + 1] (overwritten), and the regions around it that are not open; return its number."""
    rows, cells, table, order, runs, tails, totals, pool, free, used, _, turns = regions
    features, opened = len(cell) - 1, np.int64(totals[REGIONS])
    inner = np.int64(-1)
    for scale in range(len(order)):
        cell[features] = scale
        place = find_cell(cells, table, cell)
        number = np.int64(table[place]) - 1
        known = number >= 0
        if not known:
            number = np.int64(totals[REGIONS])
            totals[REGIONS] = number + 1
            table[place] = number + 1
            for axis in range(len(cell)):
                cells[number, axis] = cell[axis]
            rows[number].parent = rows[number].child = rows[number].sibling = -1
            rows[number].count = rows[number].length = 0
            enter(order, runs, tails, totals, rows, scale, number)
            _meet_neighbours(rows, cells, table, order, runs, tails, totals, scale, number, cell, turns)
        if inner >= 0:
            rows[inner].parent, rows[inner].sibling = number, rows[number].child
            rows[number].child = inner
        if known:
            break
        inner = number
        for axis in range(features):
            cell[axis] >>= 1
    rows[opened].start, rows[opened].size = take(pool, free, used, np.int64(SMALLEST)), SMALLEST
    return opened


@njit(inline="always")
def _meet_neighbours(rows: Any, cells: NDArray[np.int64], table: NDArray[np.int32], order: Rows, runs: Any,
                     tails: Rows, totals: NDArray[np.int64], scale: Number, number: Number,
                     cell: NDArray[np.int64], turns: IndexArray) -> None:
    """Count the neighbours of a new region that are not open; those that it surrounds, and itself, rise."""
    missing = 2 * (len(cell) - 1)
    for axis in range(len(cell) - 1):
        for side in (-1, 1):
            before = step_aside(cell, axis, side, turns, scale)
            place = find_cell(cells, table, cell)
            cell[axis] = before
            other = np.int64(table[place]) - 1
            if other < 0:
                continue
            missing -= 1
            if other != number:
                rows[other].missing -= 1
                if rows[other].missing == 0:
                    lift(order, runs, tails, totals, rows, scale, other, key_of(rows, other))
    rows[number].missing = missing
    if missing == 0:
        lift(order, runs, tails, totals, rows, scale, number, key_of(rows, number))
