"""Where the walls of a maze are: the one source of FCL boxes, kernel rectangles and pictures."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray

THICKNESS = 0.1
MIN_SIZE, MAX_SIZE = 2, 50
Cell = tuple[int, int]
Passage = tuple[Cell, Cell]


@dataclass(frozen=True, eq=False)
class MazeLayout:
    """A square of `size` x `size` unit cells with walls on their borders.

    Cell (i, j) is the square [i, i + 1] x [j, j + 1]; j grows upwards.

    Attributes:
        vertical: Whether there is a wall on x = i along row j [size + 1, size]; read-only, as all arrays here.
        horizontal: Whether there is a wall on y = j along column i [size, size + 1].
        rectangles: The walls [W, 4] (x0, y0, x1, y1), 0.1 thick, collinear neighbours merged.
    """

    vertical: BoolArray
    horizontal: BoolArray
    rectangles: Array = field(init=False)

    def __post_init__(self) -> None:
        half = THICKNESS / 2
        walls = [(x, a, x, b) for x, column in enumerate(self.vertical) for a, b in _runs(column)]
        walls += [(a, y, b, y) for y, row in enumerate(self.horizontal.T) for a, b in _runs(row)]
        rectangles = np.array(walls, dtype=np.float64) + np.array([-half, -half, half, half])
        object.__setattr__(self, "rectangles", rectangles)
        for array in (self.vertical, self.horizontal, rectangles):
            array.setflags(write=False)

    @property
    def size(self) -> int:
        """Number of cells along each axis."""
        return len(self.horizontal)

    @classmethod
    def from_size(cls, size: int, maze_seed: int = 0) -> "MazeLayout":
        """Return the thesis's maze: U for size 2, S for size 3, else a recursive backtracker's.

        Raises:
            InvalidOption: the size or the seed is out of range.
        """
        if not (_is_integer(size) and MIN_SIZE <= size <= MAX_SIZE):
            raise InvalidOption(f"size={size!r}: expected an integer from {MIN_SIZE} to {MAX_SIZE}")
        if not (_is_integer(maze_seed) and maze_seed >= 0):
            raise InvalidOption(f"maze_seed={maze_seed!r}: expected an integer >= 0")
        return _made_before(int(size), int(maze_seed))

    @classmethod
    def from_passages(cls, size: int, passages: Iterable[Passage]) -> "MazeLayout":
        """Return the maze in which the given pairs of neighbouring cells are connected, and no others."""
        vertical = np.ones((size + 1, size), dtype=np.bool_)
        horizontal = np.ones((size, size + 1), dtype=np.bool_)
        for (i, j), (k, m) in passages:
            if j == m:
                vertical[max(i, k), j] = False
            else:
                horizontal[i, max(j, m)] = False
        return cls(vertical, horizontal)

    @classmethod
    def from_drawing(cls, rows: Sequence[str]) -> "MazeLayout":
        """Return the maze that is drawn as `draw` draws it: 2 * size + 1 rows, the top one first.

        In a drawing the corners (even row, even column) and the cells (odd, odd) may hold any character; on a
        border, a space is a passage and `-` or `|` is a wall. The fixed 2x2 maze of the thesis is

            +-+-+
            |   |
            +-+ +
            |   |
            +-+-+

        Raises:
            InvalidOption: the drawing is not square, open to the outside, or has other marks on a border.
        """
        _check_drawing(rows)
        grid = np.array([list(row) for row in rows[::-1]]).T  # [column, row], upwards
        vertical, horizontal = grid[0::2, 1::2], grid[1::2, 0::2]
        strange = set(np.unique(vertical)) - {" ", "|"} | set(np.unique(horizontal)) - {" ", "-"}
        if strange:
            found = "".join(sorted(strange))
            raise InvalidOption(f"layout: expected '-', '|' or ' ' between cells, got {found!r}")
        layout = cls(vertical == "|", horizontal == "-")
        if not (layout.vertical[[0, -1]].all() and layout.horizontal[:, [0, -1]].all()):
            raise InvalidOption("layout: the outer walls must be closed")
        return layout

    def draw(self, marks: dict[tuple[int, int], str] | None = None) -> list[str]:
        """Return the drawing of the maze, the top row first, with a character in each marked cell (i, j)."""
        grid = np.full((2 * self.size + 1, 2 * self.size + 1), " ")
        grid[0::2, 0::2] = "+"
        grid[0::2, 1::2] = np.where(self.vertical, "|", " ")
        grid[1::2, 0::2] = np.where(self.horizontal, "-", " ")
        for (i, j), mark in (marks or {}).items():
            grid[2 * i + 1, 2 * j + 1] = mark
        return ["".join(row) for row in grid.T[::-1]]


MAZES_KEPT = 32
"""Mazes that are not made again while they are among the last ones: executions and workers ask for the same ones."""


@lru_cache(MAZES_KEPT)
def _made_before(size: int, maze_seed: int) -> MazeLayout:
    return MazeLayout.from_passages(size, passages_of(size, maze_seed))


def _runs(present: BoolArray) -> Iterator[tuple[int, int]]:
    """Yield the half-open ranges in which `present` is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], present, [False])).astype(np.int8)))
    yield from zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True)


def _is_integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _check_drawing(rows: Sequence[str]) -> None:
    """Refuse what is not a square of characters of a possible size."""
    if isinstance(rows, str) or not all(isinstance(row, str) for row in rows):
        raise InvalidOption("layout: expected a list of strings, one for each row of the drawing")
    size = (len(rows) - 1) // 2
    if len(rows) % 2 == 0 or not MIN_SIZE <= size <= MAX_SIZE:
        raise InvalidOption(f"layout: expected 2 * size + 1 rows with size {MIN_SIZE} to {MAX_SIZE}, "
                            f"got {len(rows)} rows")
    for number, row in enumerate(rows):
        if len(row) != len(rows):
            raise InvalidOption(f"layout: expected {len(rows)} characters in row {number}, got {row!r}")


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
