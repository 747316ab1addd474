"""OMPL's KPIECE1 as one compiled loop: two heaps of cells, by importance."""

from typing import NamedTuple

import numba
import numpy as np
from numba import types
from numba.core.types import npy_rng
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.tree import GROWTH, Columns, resized_copy
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.cells import cell_of, find_cell, step_aside
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE
from pbcs_ompl.planners.kernels.grid import CELLS, GRID_TYPE, NODES, Grid, put
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.motion import ENDED, REACHED, draw_control, draw_duration, move
from pbcs_ompl.planners.kernels.runs import Number

BORDER_SHARE, GOOD, BAD, DULL_SHARE = 0.8, 0.9, 0.45, 0.05  # OMPL's defaults, and the share of dull motions it keeps
INTERIOR, EXTERIOR, ITERATION = range(3)  # places of `counts`: the sizes of the two heaps, and motions so far plus one
CELL = np.dtype([("score", np.float64), ("coverage", np.float64), ("importance", np.float64), ("born", np.int64),
                 ("selections", np.int64), ("neighbours", np.int32), ("place", np.int32)])
"""What is known of a cell; `born` is the iteration in which it was opened, `place` that in its heap."""


class Judged(NamedTuple):
    """The arrays. M rows for cells."""

    known: NDArray[np.void]
    """Records of CELL [M]."""
    heaps: NDArray[np.int32]
    """Interior and exterior cells [2, M], the most important first."""
    counts: IndexArray
    """See INTERIOR [3]."""


JUDGED_TYPE = types.NamedTuple((numba.from_dtype(CELL)[::1], types.int32[:, ::1], types.int64[::1]), Judged)
_matrix = types.float64[:, ::1]
_vector = types.float64[::1]
_integers = types.int64[::1]


def none_judged() -> Judged:
    """Return the arrays without cells."""
    return Judged(np.empty(1 << 10, CELL), np.empty((2, 1 << 10), np.int32), np.array([0, 0, 1]))


def reserve(judged: Judged, cells: int) -> Judged:
    """Return the arrays with space for `cells` cells; those that were passed are not to be used any more."""
    if cells <= len(judged.known):
        return judged
    most, used = max(GROWTH * len(judged.known), cells), len(judged.known)
    heaps = np.empty((2, most), np.int32)
    heaps[:, :used] = judged.heaps
    return Judged(resized_copy(judged.known, used, most), heaps, judged.counts)


@njit(inline="always")
def _heap_of(known: NDArray[np.void], number: Number, axes: int) -> int:
    """Return the heap of a cell: those are interior that have all their neighbours along the axes."""
    return INTERIOR if known[number].neighbours >= 2 * axes else EXTERIOR


@njit()
def _sift(judged: Judged, heap: int, place: Number) -> None:
    """Move the cell at a place of a heap to where it belongs."""
    known, heaps, counts = judged.known, judged.heaps, judged.counts
    number = np.int64(heaps[heap, place])
    importance = known[number].importance
    while place > 0:
        above = np.int64(heaps[heap, (place - 1) // 2])
        if known[above].importance >= importance:
            break
        heaps[heap, place], known[above].place = above, place
        place = (place - 1) // 2
    while True:
        below = 2 * place + 1
        if below >= counts[heap]:
            break
        if (below + 1 < counts[heap]
                and known[heaps[heap, below + 1]].importance > known[heaps[heap, below]].importance):
            below += 1
        lower = np.int64(heaps[heap, below])
        if known[lower].importance <= importance:
            break
        heaps[heap, place], known[lower].place = lower, place
        place = below
    heaps[heap, place], known[number].place = number, place


@njit()
def _judge(judged: Judged, number: Number) -> None:
    """Compute the importance of a cell."""
    known = judged.known
    known[number].importance = known[number].score / (
        (known[number].neighbours + 1) * known[number].coverage * known[number].selections)


@njit()
def _enter(judged: Judged, heap: int, number: Number) -> None:
    """Put a cell into a heap."""
    place = judged.counts[heap]
    judged.counts[heap] = place + 1
    judged.heaps[heap, place], judged.known[number].place = number, place
    _sift(judged, heap, place)


@njit()
def _leave(judged: Judged, heap: int, number: Number) -> None:
    """Take a cell out of a heap."""
    place, last = np.int64(judged.known[number].place), judged.counts[heap] - 1
    judged.counts[heap] = last
    if place < last:
        moved = judged.heaps[heap, last]
        judged.heaps[heap, place], judged.known[moved].place = moved, place
        _sift(judged, heap, place)


@njit(error_model="numpy")
def _meet_neighbours(grid: Grid, judged: Judged, number: Number, cell: NDArray[np.int64]) -> None:
    """Count the neighbours of a new cell, and itself among theirs."""
    known, axes = judged.known, len(cell)
    known[number].neighbours = 0
    for axis in range(axes):
        for side in (-1, 1):
            before = step_aside(cell, axis, side, grid.turns, 0)
            other = np.int64(grid.table[find_cell(grid.cells, grid.table, cell)]) - 1
            cell[axis] = before
            if other < 0:
                continue
            known[number].neighbours += 1
            if other == number:
                continue
            known[other].neighbours += 1
            _judge(judged, other)
            if known[other].neighbours == 2 * axes:
                _leave(judged, EXTERIOR, other)
                _enter(judged, INTERIOR, other)
            else:
                _sift(judged, _heap_of(known, other, axes), known[other].place)


@njit(error_model="numpy")
def add(grid: Grid, judged: Judged, features: Array, node: int, steps: int, size: Array,
        cell: NDArray[np.int64]) -> None:
    """Add the end of a motion of `steps` steps to its cell."""
    number, opened = put(grid, features, node, size, cell)
    known = judged.known
    if opened:
        known[number].coverage, known[number].selections = steps, 1
        known[number].born = judged.counts[ITERATION]
        known[number].score = 1.0 + np.log(float(judged.counts[ITERATION]))
        _meet_neighbours(grid, judged, number, cell)
        _judge(judged, number)
        _enter(judged, _heap_of(known, number, len(cell)), number)
    else:
        known[number].coverage += steps
        _judge(judged, number)
        _sift(judged, _heap_of(known, number, len(cell)), known[number].place)


@njit(error_model="numpy")
def _renew(grid: Grid, judged: Judged) -> None:
    """Add its first score to that of each cell, and build the heaps again."""
    cells, axes = grid.totals[CELLS], grid.cells.shape[1]
    judged.counts[INTERIOR] = judged.counts[EXTERIOR] = 0
    for number in range(cells):
        judged.known[number].score += 1.0 + np.log(float(judged.known[number].born))
        _judge(judged, number)
        _enter(judged, _heap_of(judged.known, number, axes), number)


@njit(error_model="numpy")
def select(grid: Grid, judged: Judged, rng: np.random.Generator) -> tuple[Number, Number]:
    """Begin an iteration; return the most important cell of a heap, and one of its nodes, rather a late one."""
    known, heaps, counts = judged.known, judged.heaps, judged.counts
    counts[ITERATION] += 1
    share = max(BORDER_SHARE, counts[EXTERIOR] / (counts[EXTERIOR] + counts[INTERIOR]))
    heap = EXTERIOR if rng.random() < share else INTERIOR
    if counts[heap] == 0:
        heap = INTERIOR + EXTERIOR - heap
    number = np.int64(heaps[heap, 0])
    if known[number].score < np.finfo(np.float64).eps:
        _renew(grid, judged)
    known[number].selections += 1
    length = np.int64(grid.slices[number].length)
    drawn = length + length / 3.0 * rng.standard_normal()
    if drawn > length:
        drawn = 2.0 * length - drawn
    chosen = min(int(max(drawn, 0.0)), length - 1)
    node: Number = np.int64(grid.pool[grid.slices[number].start + chosen])
    return number, node


@njit(error_model="numpy")
def note(grid: Grid, judged: Judged, features: Array, nodes: IndexArray, number: Number, size: Array,
         rng: np.random.Generator) -> None:
    """Take note of a motion from cell `number` through nodes [T]: it is cut where it enters another cell.

    A motion is dull if all its nodes are in cells that have more than two thirds of the mean number of nodes. Most dull
    ones are not kept.
    """
    axes = grid.cells.shape[1]
    cells = np.empty((len(nodes), axes), np.int64)
    most, dull = 2 * grid.totals[NODES] // (3 * grid.totals[CELLS]), True
    for k in range(len(nodes)):
        cell_of(features, nodes[k], size, grid.turns, cells[k])
        there = np.int64(grid.table[find_cell(grid.cells, grid.table, cells[k])]) - 1
        if there < 0 or grid.slices[there].length <= most:
            dull = False
    if not dull or rng.random() < DULL_SHARE:
        begin = 0
        for k in range(len(nodes)):
            if k + 1 == len(nodes) or not (cells[k] == cells[k + 1]).all():
                add(grid, judged, features, nodes[k], k + 1 - begin, size, cells[k])
                begin = k + 1
    judged.known[number].score *= GOOD if len(nodes) else BAD
    _judge(judged, number)
    _sift(judged, _heap_of(judged.known, number, axes), judged.known[number].place)


@njit(types.Tuple((types.int64, types.boolean))(
    PARAMETERS_TYPE, _integers, _matrix, types.UniTuple(types.int64, 2), COLUMNS_TYPE, types.int64, types.int64,
    GRID_TYPE, JUDGED_TYPE, _vector, npy_rng), error_model="numpy")
def expand(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, bounds: Array,
           durations: tuple[int, int], columns: Columns, first: int, most: int, grid: Grid, judged: Judged,
           size: Array, rng: np.random.Generator) -> tuple[int, bool]:
    """Add motions of at most `most` steps together.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        bounds: Lower and upper bounds of the controls [2, A].
        durations: The least and the most steps of a control.
        columns, first: The tree's arrays, with space for `most` more nodes, and the number of nodes so far.
        most: The most steps, at least the longest duration unless no more are left.
        grid, judged, size: The cells with space for `most` more, and their edges [F].
        rng: The random numbers.

    Returns:
        How many nodes were written, and whether the last one is the goal.
    """
    parameters, columns, grid, judged = uncounted(parameters), uncounted(columns), uncounted(grid), uncounted(judged)
    nodes = np.empty(durations[1], np.int64)
    child, end = first, first + most
    while child == first or child + durations[1] <= end:
        number, node = select(grid, judged, rng)
        draw_control(bounds, columns.controls, child, rng)
        steps = min(draw_duration(durations, rng), end - child)
        begin = child
        child, how = move(parameters, feature_dims, columns, node, child, steps)
        if how >= REACHED:
            return child - first, how == REACHED
        length = child - begin - (how == ENDED)
        for k in range(length):
            nodes[k] = begin + k
        note(grid, judged, columns.features, nodes[:length], number, size, rng)
    return child - first, False
