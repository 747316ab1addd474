"""Mazes of whole cells for the ant: those of gymnasium-robotics and D4RL, and an open square."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.types import Array
from pbcs_ompl.envs.maze.layout import THICKNESS

MAPS = {
    "umaze": ("#####",
              "#S..#",
              "###.#",
              "#G..#",
              "#####"),
    "medium": ("########",
               "#S.##..#",
               "#..#...#",
               "##...###",
               "#..#...#",
               "#.#..#.#",
               "#...#.G#",
               "########"),
    "large": ("############",
              "#S...#.....#",
              "#.##.#.#.#.#",
              "#......#...#",
              "#.####.###.#",
              "#..#.#.....#",
              "##.#.#.#.###",
              "#..#...#.G.#",
              "############"),
}
"""Cells (#: wall) of U_MAZE, MEDIUM_MAZE and LARGE_MAZE of gymnasium-robotics; start and goal are those of D4RL's
antmaze-umaze, -medium and -large with a fixed goal. The top row comes first."""


@dataclass(frozen=True, eq=False)
class MazeMap:
    """A map with unit cells; its lower left corner is the origin.

    Attributes:
        walls: [W, 4] (x0, y0, x1, y1).
        extent: Width and height.
        start, goal: Centres of their cells.
    """

    walls: Array
    extent: tuple[float, float]
    start: tuple[float, float]
    goal: tuple[float, float]

    @classmethod
    def named(cls, name: str) -> "MazeMap":
        """Return one of `MAPS`; neighbouring cells of a wall in a row are one wall."""
        rows = MAPS[name][::-1]
        walls = []
        for y, row in enumerate(rows):
            edges = np.flatnonzero(np.diff([False, *(mark == "#" for mark in row), False]))
            walls += [(x0, y, x1, y + 1) for x0, x1 in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]
        places = {mark: (row.index(mark) + 0.5, y + 0.5) for y, row in enumerate(rows) for mark in "SG" if mark in row}
        return cls(np.array(walls, dtype=np.float64), (len(rows[0]), len(rows)), places["S"], places["G"])

    @classmethod
    def open(cls, size: int) -> "MazeMap":
        """Return a square of `size` cells without walls inside, from one corner to the opposite one."""
        half, end = THICKNESS / 2, float(size)
        walls = [(-half, -half, half, end + half), (end - half, -half, end + half, end + half),
                 (-half, -half, end + half, half), (-half, end - half, end + half, end + half)]
        return cls(np.array(walls), (end, end), (0.5, 0.5), (end - 0.5, end - 0.5))
