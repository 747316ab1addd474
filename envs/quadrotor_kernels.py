"""The step of a planar quadrotor, compiled: two rotors on a rigid bar, and what it hits."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import STEP_SIGNATURE
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.envs.oriented_kernels import touches, wrapped

# Places of the settings.
(EXTENT, GOAL_X, GOAL_Z, NEAR, TERMINATE, HALF_LENGTH, HALF_HEIGHT, GRAVITY, AUTHORITY, LEVERAGE, DAMPING, DRAG,
 FASTEST, FASTEST_TURN, SECONDS, PARTS) = range(16)


@njit()
def goal_distances(settings: Array, states: Array) -> Array:
    """Return the distances [B] of states [B, 6] to the goal, in its radius: below 1 is a success."""
    distances = np.empty(states.shape[0])
    for k in range(states.shape[0]):
        distances[k] = np.hypot(states[k, 0] - settings[GOAL_X], states[k, 1] - settings[GOAL_Z]) / settings[NEAR]
    return distances


@njit()
def _within(value: float, bound: float) -> float:
    return min(bound, max(-bound, value))


@njit(STEP_SIGNATURE)
def compiled_step(settings: Array, walls: Array, unused: IndexArray, states: Array, parent: int, controls: Array,
                  child: int) -> tuple[float, bool, bool]:
    """Write states[child] from states[parent] and controls[child]; return reward, terminated, success.

    The state is (x, z, tilt, vx, vz, turning rate), the tilt counter-clockwise. Rotor i pushes with
    GRAVITY / 2 (1 + AUTHORITY a_i) for each unit of mass, so that a = 0 hovers. PARTS times, with h = SECONDS / PARTS:
    rate += h (LEVERAGE (right - left) - DAMPING rate), tilt += h rate, vx -= h (lift sin(tilt) + DRAG vx),
    vz += h (lift cos(tilt) - GRAVITY - DRAG vz), (x, z) += h (vx, vz). Speeds are cut off at FASTEST and FASTEST_TURN.
    Where the next part would touch a wall, the quadrotor has crashed: it rests there, and the episode ends.
    """
    x, z, tilt = states[parent, 0], states[parent, 1], states[parent, 2]
    vx, vz, rate = states[parent, 3], states[parent, 4], states[parent, 5]
    unit, h = settings[GRAVITY] / 2.0, settings[SECONDS] / settings[PARTS]
    left = unit * (1.0 + settings[AUTHORITY] * _within(controls[child, 0], 1.0))
    right = unit * (1.0 + settings[AUTHORITY] * _within(controls[child, 1], 1.0))
    crashed = False
    for _ in range(int(settings[PARTS])):
        torque = settings[LEVERAGE] * (right - left) - settings[DAMPING] * rate
        next_rate = _within(rate + h * torque, settings[FASTEST_TURN])
        turned = wrapped(tilt + h * next_rate)
        push = -(left + right) * np.sin(turned) - settings[DRAG] * vx
        lift = (left + right) * np.cos(turned) - settings[DRAG] * vz - settings[GRAVITY]
        next_vx, next_vz = _within(vx + h * push, settings[FASTEST]), _within(vz + h * lift, settings[FASTEST])
        beside, above = x + h * next_vx, z + h * next_vz
        if touches(walls, settings[EXTENT], beside, above, turned, settings[HALF_LENGTH], settings[HALF_HEIGHT]):
            crashed, vx, vz, rate = True, 0.0, 0.0, 0.0
            break
        x, z, tilt, vx, vz, rate = beside, above, turned, next_vx, next_vz, next_rate
    states[child, 0], states[child, 1], states[child, 2] = x, z, tilt
    states[child, 3], states[child, 4], states[child, 5] = vx, vz, rate
    success = np.hypot(x - settings[GOAL_X], z - settings[GOAL_Z]) / settings[NEAR] < 1.0
    return 1.0 if success else 0.0, crashed or (success and settings[TERMINATE] != 0.0), success
