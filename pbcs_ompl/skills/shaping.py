"""Reward shaping by the potential 1/d; [Matheron2020] section 7.2.3."""

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray

GOAL_REWARD = 10.0


def shaped_rewards(before: Array, after: Array, reached: BoolArray, radius: float) -> Array:
    """Return the shaped rewards [B] of steps from distance `before` to distance `after` [B].

    R = 10 where the goal is reached, else Phi(s') - Phi(s) with Phi(s) = 1 / d(s, goal).

    Differs: d is bounded below by the goal's `radius`. Outside the goal this changes nothing for a ball; it keeps a
    step that leaves the goal from an arbitrarily small distance finite.
    """
    gain = 1.0 / np.maximum(after, radius) - 1.0 / np.maximum(before, radius)
    return np.where(reached, GOAL_REWARD, gain)
