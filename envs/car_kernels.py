"""The step of a car, compiled: the kinematic bicycle, and what it hits."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import STEP_SIGNATURE
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.envs.oriented_kernels import touches, wrapped

# Places of the settings.
(EXTENT, GOAL_X, GOAL_Y, GOAL_HEADING, NEAR, ALIGNED, TERMINATE, HALF_LENGTH, HALF_WIDTH, AHEAD, WHEELBASE, STEERING,
 ACCELERATION, SLOWEST, FASTEST, SECONDS, PARTS) = range(17)


@njit()
def goal_distance(settings: Array, x: float, y: float, heading: float) -> float:
    """Return the larger of the distance and the turn to the goal's pose, in their tolerances: below 1 is a success."""
    away = np.hypot(x - settings[GOAL_X], y - settings[GOAL_Y]) / settings[NEAR]
    off = abs(wrapped(heading - settings[GOAL_HEADING])) / settings[ALIGNED]
    larger: float = max(away, off)
    return larger


@njit()
def goal_distances(settings: Array, states: Array) -> Array:
    """Return `goal_distance` of states [B, 4]."""
    distances = np.empty(states.shape[0])
    for k in range(states.shape[0]):
        distances[k] = goal_distance(settings, states[k, 0], states[k, 1], states[k, 2])
    return distances


@njit(STEP_SIGNATURE)
def compiled_step(settings: Array, walls: Array, unused: IndexArray, states: Array, parent: int, controls: Array,
                  child: int) -> tuple[float, bool, bool]:
    """Write states[child] from states[parent] and controls[child]; return reward, terminated, success.

    PARTS times, with h = SECONDS / PARTS: v += h a, heading += h v tan(steering) / WHEELBASE,
    (x, y) += h v (cos heading, sin heading). (x, y) is the middle of the rear axle, the centre of the body is AHEAD of
    it. Where the next part would touch a wall, the car stands still from there on.
    """
    x, y, heading, speed = states[parent, 0], states[parent, 1], states[parent, 2], states[parent, 3]
    acceleration = min(1.0, max(-1.0, controls[child, 0])) * settings[ACCELERATION]
    steering = min(1.0, max(-1.0, controls[child, 1])) * settings[STEERING]
    turn, h = np.tan(steering) / settings[WHEELBASE], settings[SECONDS] / settings[PARTS]
    for _ in range(int(settings[PARTS])):
        faster = min(settings[FASTEST], max(settings[SLOWEST], speed + h * acceleration))
        turned = wrapped(heading + h * faster * turn)
        c, s = np.cos(turned), np.sin(turned)
        right, up = x + h * faster * c, y + h * faster * s
        if touches(walls, settings[EXTENT], right + settings[AHEAD] * c, up + settings[AHEAD] * s, turned,
                   settings[HALF_LENGTH], settings[HALF_WIDTH]):
            speed = 0.0
            break
        x, y, heading, speed = right, up, turned, faster
    states[child, 0], states[child, 1], states[child, 2], states[child, 3] = x, y, heading, speed
    success = goal_distance(settings, x, y, heading) < 1.0
    return 1.0 if success else 0.0, success and settings[TERMINATE] != 0.0, success
