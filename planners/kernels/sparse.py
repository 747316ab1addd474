"""Random nodes of sparse regions, from the bins of a BinQueue."""

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.planners.kernels.bin_queue import BinQueue
from pbcs_ompl.planners.kernels.cells import find_cell


@njit()
def draw_sparse(queue: BinQueue, reach: int, rng: np.random.Generator, nodes: NDArray[np.int64]) -> None:
    """Write into nodes [B] independent draws with probability proportional to 1 / (nodes in the bins around).

    Around a bin are the (2 reach + 1)^F bins that differ by at most `reach` in each coordinate. A random bin
    with n nodes and m around it is kept with probability n / m, then any of its nodes is as good: each node's
    chance is proportional to (n / m) / n.
    """
    cell = np.empty(queue.cells.shape[1], np.int64)
    for row in range(len(nodes)):
        while True:
            number = int(rng.random() * queue.head[0].length)
            inside = queue.heads[number].length
            if rng.random() * _around(queue, number, reach, cell) < inside:
                break
        nodes[row] = queue.pool[queue.heads[number].start + int(rng.random() * inside)]


@njit()
def draw_sparsest(queue: BinQueue, reach: int, rng: np.random.Generator, nodes: NDArray[np.int64]) -> None:
    """Write into nodes [B] independent draws from those with the fewest nodes in the bins around, all as likely."""
    cell = np.empty(queue.cells.shape[1], np.int64)
    around = np.empty(queue.head[0].length, np.int64)
    for number in range(len(around)):
        around[number] = _around(queue, number, reach, cell)
    sparsest = np.flatnonzero(around == around.min())
    ends = np.empty(len(sparsest), np.int64)
    count = 0
    for index in range(len(sparsest)):
        count += queue.heads[sparsest[index]].length
        ends[index] = count
    for row in range(len(nodes)):
        chosen = int(rng.random() * count)
        place = np.searchsorted(ends, chosen, side="right")
        nodes[row] = queue.pool[queue.heads[sparsest[place]].start + ends[place] - 1 - chosen]


@njit()
def _around(queue: BinQueue, number: int, reach: int, cell: NDArray[np.int64]) -> int:
    """Return how many nodes are in the bins around one, itself included."""
    axes = len(cell)
    width = 2 * reach + 1
    total = 0
    for code in range(width ** axes):
        rest = code
        for axis in range(axes):
            cell[axis] = queue.cells[number, axis] + rest % width - reach
            rest //= width
        found = queue.table[find_cell(queue.cells, queue.table, cell)] - 1
        if found >= 0:
            total += queue.heads[found].length
    return total
