"""The least number of steps to the goal of a maze, by a graph of what corners see of each other.

A point moves by up to 0.1 along each axis in a step, so the length of a way is measured in the maximum norm. A way that
is pulled tight bends at corners of walls only, and pulling makes it longer in no norm.
"""

import numpy as np
from scipy.sparse.csgraph import dijkstra

from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs.maze.maze import MazeEnv
from pbcs_ompl.envs.point_env import GOAL_RADIUS, MAX_STEP

CLEARANCE = 1e-7
"""How far beside a corner a way passes it."""
POINTS = 64
"""On the border of the goal."""


def least_steps(env: MazeEnv) -> int:
    """Return a lower bound of the steps from the start to the goal, which no plan can go below."""
    assert env.goal is not None
    corners = np.concatenate([env.walls[:, [x, y]] + CLEARANCE * np.array([x - 1, y - 2])
                              for x, y in ((0, 1), (0, 3), (2, 1), (2, 3))])
    corners = corners[env.in_bounds(corners)]
    angles = np.arange(POINTS) * 2.0 * np.pi / POINTS
    goals = env.goal + GOAL_RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = np.vstack([env.start[None], corners, goals])
    lengths = np.abs(points[:, None] - points[None]).max(axis=2)
    for row, point in enumerate(points):
        lengths[row, ~_sees(point, points, env.walls)] = np.inf
    lengths[np.isinf(lengths)] = 0.0  # no edge
    distances = dijkstra(lengths, directed=False, indices=0)
    return int(np.ceil(distances[-POINTS:].min() / MAX_STEP - 1e-6))


def _sees(point: Array, others: Array, walls: Array) -> BoolArray:
    """Return which others [B, 2] a segment from a point [2] reaches without touching a wall [B] (separating axes)."""
    x0, y0 = point
    x1, y1 = others[:, :1], others[:, 1:]
    left, bottom, right, top = walls.T
    apart = ((np.maximum(x0, x1) < left) | (np.minimum(x0, x1) > right)
             | (np.maximum(y0, y1) < bottom) | (np.minimum(y0, y1) > top))
    sides = np.stack([(x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) for x in (left, right) for y in (bottom, top)])
    apart |= (sides > 0.0).all(axis=0) | (sides < 0.0).all(axis=0)
    free: BoolArray = apart.all(axis=1)
    return free
