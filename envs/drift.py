"""Drift, 1D-Toy without its reward: whatever an agent does here, it does by itself: `pbcs/Drift-v0`."""

import numpy as np

from pbcs_ompl.core.types import Array
from pbcs_ompl.envs.line_env import LineEnv


class DriftEnv(LineEnv):
    """S = [0, 1], A = [-0.1, 0.1], start 0; no transition is rewarded or terminal.

    Source: [Matheron2020] 6.3.1. Differs: none.
    """

    def __init__(self) -> None:
        super().__init__(low=0.0)

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, 1] to the goal: infinite, there is none."""
        return np.full(len(states), np.inf)
