"""The step of a point in a maze with FCL deciding every collision: slow; the kernel is checked against it."""

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs.maze.kernels import CLEARANCE
from pbcs_ompl.envs.walls_fcl import WallsFcl


def move_by_fcl(walls: WallsFcl, states: Array, targets: Array, slide: bool) -> tuple[Array, BoolArray]:
    """Return where the steps from states [B, 2] to targets [B, 2] end, and whether they hit a wall [B].

    With `slide` the contact is found by halving the step, and the point stops CLEARANCE short of it along the
    longer axis of the step. Differs: the kernel measures along the axis of contact.
    """
    hits = walls.hit_by(states, targets)
    after = np.where(hits[:, None], states, targets)
    if slide:
        for k in np.flatnonzero(hits):
            after[k] = _last_free(walls, states[k], targets[k])
    return after, hits


def _last_free(walls: WallsFcl, start: Array, target: Array) -> Array:
    """Return the last point before the first wall on the way from start [2] to target [2]."""
    step = target - start
    free, blocked = 0.0, 1.0
    while (blocked - free) * np.abs(step).max() > CLEARANCE / 4.0:
        middle = (free + blocked) / 2.0
        if walls.segment_hits(start, start + middle * step):
            blocked = middle
        else:
            free = middle
    fraction = free - CLEARANCE / np.abs(step).max() if step.any() else 0.0
    return start + max(fraction, 0.0) * step
