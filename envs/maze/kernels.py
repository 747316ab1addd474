"""The step of a point in a maze, compiled: arrays in, arrays out.

A step is the segment [p, q] with q = p + a as rounded; it hits a wall when it touches the closed rectangle.
All entry points share `_move`, so that one step and a batch of steps give the same bits.
"""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import STEP_SIGNATURE
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.envs.point_kernels import FIRST_FREE, WholeStep, displacement, outcome, whole_step
from pbcs_ompl.envs.wall_grid import CELLS_PER_UNIT

Point = tuple[float, float]

CLEARANCE = 1e-6
"""With "slide" the point stops this far from the wall (measured along the axis of contact)."""
ROUNDING = 4e-16
"""Bound of the relative error of a 2 x 2 determinant of differences: (3 + 16 u) u with u = 2**-53, rounded up
(Shewchuk 1997, Adaptive Precision Floating-Point Arithmetic, orient2d)."""

# What the step of a point runs through is inlined: a call costs as much as looking at a wall.

# Places of the maze's own settings in the array `settings`, after those of `point_kernels`.
SLIDE, CELLS = FIRST_FREE, FIRST_FREE + 1


@njit()
def hits_rectangle(x0: float, y0: float, x1: float, y1: float,
                   left: float, bottom: float, right: float, top: float) -> bool:
    """Return whether the segment (x0, y0)-(x1, y1) touches the closed rectangle.

    Separating axes: the two of the rectangle, compared exactly, then the normal of the segment, on which the
    two extreme corners are compared. A pass so close to a corner that rounding hides the sign is a hit, so
    that none is ever missed.
    """
    if max(x0, x1) < left or min(x0, x1) > right or max(y0, y1) < bottom or min(y0, y1) > top:
        return False
    dx, dy = x1 - x0, y1 - y0
    if dx > 0.0:
        high, low = top, bottom
    else:
        high, low = bottom, top
    if dy > 0.0:
        near, far = left, right
    else:
        near, far = right, left
    u, v = dx * (high - y0), dy * (near - x0)
    if u - v < -ROUNDING * (abs(u) + abs(v)):
        return False
    u, v = dx * (low - y0), dy * (far - x0)
    return not u - v > ROUNDING * (abs(u) + abs(v))


@njit()
def _cell(x: float, cells: float) -> int:
    """Return the grid cell along one axis; total, NaN and the outside included."""
    scaled = x * CELLS_PER_UNIT
    if not scaled > 0.0:
        return 0
    if scaled >= cells:
        return int(cells) - 1
    return int(scaled)


@njit(inline="always")
def _hits_any(rectangles: Array, lists: IndexArray, begin: int, end: int,
              x0: float, y0: float, x1: float, y1: float) -> bool:
    for k in range(begin, end):
        wall = lists[k]  # a view of the row would cost as much as the test
        if hits_rectangle(x0, y0, x1, y1, rectangles[wall, 0], rectangles[wall, 1], rectangles[wall, 2],
                          rectangles[wall, 3]):
            return True
    return False


@njit()
def _entry(x0: float, y0: float, dx: float, dy: float,
           left: float, bottom: float, right: float, top: float) -> float:
    """Return the fraction of the step after which it is CLEARANCE short of the rectangle that it hits."""
    along_x = along_y = stop_x = stop_y = -np.inf
    if dx != 0.0:
        along_x = ((left if dx > 0.0 else right) - x0) / dx
        stop_x = along_x - CLEARANCE / abs(dx)
    if dy != 0.0:
        along_y = ((bottom if dy > 0.0 else top) - y0) / dy
        stop_y = along_y - CLEARANCE / abs(dy)
    return stop_x if along_x > along_y else stop_y


@njit()
def _slide(rectangles: Array, lists: IndexArray, begin: int, end: int,
           x0: float, y0: float, x1: float, y1: float) -> Point:
    """Return the last point of the step before the walls, or its start where there is no space to move."""
    dx, dy = x1 - x0, y1 - y0
    fraction = 1.0
    for k in range(begin, end):
        wall = rectangles[lists[k]]
        left, bottom, right, top = wall[0], wall[1], wall[2], wall[3]
        if hits_rectangle(x0, y0, x1, y1, left, bottom, right, top):
            fraction = min(fraction, _entry(x0, y0, dx, dy, left, bottom, right, top))
    if not fraction > 0.0:
        return x0, y0
    x, y = x0 + fraction * dx, y0 + fraction * dy
    if _hits_any(rectangles, lists, begin, end, x0, y0, x, y):
        return x0, y0
    return x, y


@njit(inline="always")
def _move(rectangles: Array, lists: IndexArray, settings: Array,
          x: float, y: float, a: float, b: float) -> tuple[float, float, bool]:
    """Return the next position, and whether the step hit a wall."""
    x1, y1 = x + displacement(settings, a), y + displacement(settings, b)
    if x1 != x1 or y1 != y1:
        return x1, y1, False
    cells = settings[CELLS]
    cell = _cell(x, cells) * int(cells) + _cell(y, cells)
    begin, end = lists[cell], lists[cell + 1]
    if not _hits_any(rectangles, lists, begin, end, x, y, x1, y1):
        return x1, y1, False
    if settings[SLIDE] == 0.0:
        return x, y, True
    x1, y1 = _slide(rectangles, lists, begin, end, x, y, x1, y1)
    return x1, y1, True


@njit()
def step_one(rectangles: Array, lists: IndexArray, settings: Array,
             x: float, y: float, a: float, b: float) -> WholeStep:
    """Return all that a step of one point shows (see `whole_step`)."""
    x1, y1, hit = _move(rectangles, lists, settings, x, y, a, b)
    return whole_step(settings, x1, y1, hit)


@njit()
def move(rectangles: Array, lists: IndexArray, settings: Array,
         states: Array, controls: Array) -> tuple[Array, BoolArray]:
    """Return the next states [B, 2] after controls [B, 2], and whether a wall was hit [B]."""
    count = states.shape[0]
    after = np.empty((count, 2))
    hits = np.empty(count, dtype=np.bool_)
    for k in range(count):
        after[k, 0], after[k, 1], hits[k] = _move(
            rectangles, lists, settings, states[k, 0], states[k, 1], controls[k, 0], controls[k, 1])
    return after, hits


@njit(STEP_SIGNATURE)
def compiled_step(settings: Array, rectangles: Array, lists: IndexArray, states: Array, parent: int,
                  controls: Array, child: int) -> tuple[float, bool, bool]:
    """Write states[child] from states[parent] and controls[child]; return reward, terminated, success."""
    x, y, hit = _move(rectangles, lists, settings, states[parent, 0], states[parent, 1],
                      controls[child, 0], controls[child, 1])
    states[child, 0], states[child, 1] = x, y
    return outcome(settings, x, y, hit)
