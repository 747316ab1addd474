"""Extent and walls of the mazes of gymnasium-robotics."""

from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array


def has_map(env: Any) -> bool:
    """Return whether `env` is a maze of gymnasium-robotics."""
    return hasattr(getattr(env, "maze", None), "maze_map")


def map_bounds(maze: Any) -> tuple[Array, Array]:
    """Return the corners (x, y) of the map."""
    high = np.array([maze.x_map_center, maze.y_map_center], dtype=np.float64)
    return -high, high


def wall_rectangles(maze: Any) -> Array:
    """Return the cells that are walls [W, 4] (x0, y0, x1, y1)."""
    half = maze.maze_size_scaling / 2
    centres = [maze.cell_rowcol_to_xy(np.array([row, column])) for row, cells in enumerate(maze.maze_map)
               for column, cell in enumerate(cells) if cell == 1]
    return np.array([[x - half, y - half, x + half, y + half] for x, y in centres], dtype=np.float64).reshape(-1, 4)
