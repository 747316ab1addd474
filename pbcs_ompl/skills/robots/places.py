"""Where robots are on lines: in the plane, and turned, where that counts."""

import numpy as np

from pbcs_ompl.core.robot import Robot
from pbcs_ompl.core.types import Array
from pbcs_ompl.skills.path_following.line import Line, erase_loops, unwrapped

GAP = 8.0
"""Longest hop along each axis by which loops of a plan are erased, in spacings of lines (ours)."""
TURNED_GAP = 2.0
"""The same where the heading counts: what drives along a line cannot hop sideways (ours)."""


def dimensions(robot: Robot) -> int:
    """Return the number F of dimensions of lines: those of the plane, and the heading where it counts."""
    return 2 if robot.turning == 0.0 else 3


def periods(robot: Robot) -> Array | None:
    """Return the period of each dimension of lines [F]; None where none has one."""
    return None if robot.turning == 0.0 else np.array([0.0, 0.0, 2.0 * np.pi * robot.turning])


def places_of(robot: Robot, observations: Array) -> Array:
    """Return the places [B, F] on lines that observations [B, O] show: (x, y, turning heading)."""
    places: Array = observations[:, list(robot.place)]
    if robot.turning == 0.0:
        return places
    return np.column_stack([places, robot.turning * robot.heading(observations)])


def line_through(robot: Robot, places: Array, spacing: float) -> Line:
    """Return the line along the places [T+1, F] of a plan, without its loops."""
    turns = periods(robot)
    gap = (GAP if turns is None else TURNED_GAP) * spacing
    kept = places[erase_loops(places, gap, turns)]
    return Line.through(kept if turns is None else unwrapped(kept, turns), spacing, periods=turns)
