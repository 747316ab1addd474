"""What the compiled steps of all point environments share: clipping, the goal, the reward."""

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, BoolArray

WholeStep = tuple[float, float, bool, float, bool, float]

# Places of the settings in the array `settings`, which every kernel takes.
LIMIT, SCALE, GOAL_X, GOAL_Y, GOAL_RADIUS, PENALTY, TERMINATE, FIRST_FREE = range(8)


@njit()
def displacement(settings: Array, a: float) -> float:
    """Return how far a control moves the point along one axis; NaN stays NaN."""
    limit = settings[LIMIT]
    if a > limit:
        a = limit
    elif a < -limit:
        a = -limit
    moved: float = a * settings[SCALE]
    return moved


@njit()
def distance(settings: Array, x: float, y: float) -> float:
    """Return the Euclidean distance of (x, y) to the centre of the goal; infinite without a goal."""
    dx, dy = x - settings[GOAL_X], y - settings[GOAL_Y]
    length: float = np.sqrt(dx * dx + dy * dy)
    return length


@njit()
def goal_distance(settings: Array, states: Array) -> Array:
    """Return the Euclidean distances [B] of states [B, 2] to the centre of the goal."""
    distances = np.empty(states.shape[0])
    for k in range(states.shape[0]):
        distances[k] = distance(settings, states[k, 0], states[k, 1])
    return distances


@njit()
def outcome(settings: Array, x: float, y: float, hit: bool) -> tuple[float, bool, bool]:
    """Return reward, terminated and success of a step that ended in (x, y)."""
    reached = distance(settings, x, y) < settings[GOAL_RADIUS]
    reward = (1.0 if reached else 0.0) + (settings[PENALTY] if hit else 0.0)
    return reward, reached and settings[TERMINATE] != 0.0, reached


@njit()
def whole_step(settings: Array, x: float, y: float, hit: bool) -> WholeStep:
    """Return all that a step shows which ended in (x, y): x, y, hit, reward, terminated, distance to the goal."""
    reward, terminated, _ = outcome(settings, x, y, hit)
    return x, y, hit, reward, terminated, distance(settings, x, y)


@njit()
def finish(settings: Array, after: Array, hits: BoolArray) -> tuple[Array, BoolArray, BoolArray]:
    """Return rewards, terminated and success [B] of steps to `after` [B, 2] that hit a wall or not [B]."""
    count = after.shape[0]
    rewards = np.empty(count)
    terminated = np.empty(count, dtype=np.bool_)
    success = np.empty(count, dtype=np.bool_)
    for k in range(count):
        rewards[k], terminated[k], success[k] = outcome(settings, after[k, 0], after[k, 1], hits[k])
    return rewards, terminated, success
