"""Which neighbouring cells of a maze are connected: the thesis's fixed mazes, and random ones."""

from itertools import pairwise

import numpy as np

Cell = tuple[int, int]
Passage = tuple[Cell, Cell]

U_SHAPE: tuple[Cell, ...] = ((0, 0), (1, 0), (1, 1), (0, 1))
S_SHAPE: tuple[Cell, ...] = ((0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2))


def passages_of(size: int, maze_seed: int) -> list[Passage]:
    """Return the open borders of the thesis's maze of `size` x `size` cells ([Matheron2020] 4.1, 5.4).

    Size 2 is the fixed U, size 3 the hard S; both ignore the seed. Any other size comes from the seed.
    """
    if size == 2:
        return list(pairwise(U_SHAPE))
    if size == 3:
        return list(pairwise(S_SHAPE))
    return recursive_backtracker(size, np.random.default_rng(maze_seed))


def recursive_backtracker(size: int, rng: np.random.Generator) -> list[Passage]:
    """Carve a spanning tree of the cells depth first, from (0, 0), going back when there is no way on.

    The recursion is an explicit stack, so that no size meets Python's recursion limit.
    """
    visited = {(0, 0)}
    stack: list[Cell] = [(0, 0)]
    passages: list[Passage] = []
    while stack:
        i, j = stack[-1]
        around = ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1))
        fresh = [c for c in around if c not in visited and 0 <= c[0] < size and 0 <= c[1] < size]
        if not fresh:
            stack.pop()
            continue
        cell = fresh[int(rng.integers(len(fresh)))]
        passages.append(((i, j), cell))
        visited.add(cell)
        stack.append(cell)
    return passages
