"""Motion that is free but for obstacles: a step adds the control, seen through a matrix, to the state."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray

EXACT = 1e-9
"""Error of a prediction, relative to the largest number of the states, below which it is right."""
ROUNDS = 4
"""How often the better half of the transitions is fitted again."""
LARGEST_CONDITION = 1e6
DECIMALS = 12
"""Of the fitted numbers: what is a short decimal is exact then, and so are most steps that end where they aim."""


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """s' = s + B u + c wherever nothing is in the way, with as many controls as there are dimensions.

    Any state nearby is reached in one step then, and exactly, so that a plan stays as it was behind a short cut.

    Attributes:
        gain: B, transposed [A, D].
        inverse: That of `gain` [D, A].
        low, high: Bounds of u + B^-1 c [A], below 0 and above 0.
        drift: B^-1 c [A].
        tolerance: The largest error of a prediction.
    """

    gain: Array
    inverse: Array
    low: Array
    high: Array
    drift: Array
    tolerance: float

    @classmethod
    def shown_by(cls, model: ResettableModel, states: Array, controls: Array, after: Array) -> Self | None:
        """Return the motion by least trimmed squares; None where most transitions that change the state differ.

        Args:
            model: The environment, for the bounds of its controls.
            states: States [N, D].
            controls: The controls [N, A] that were applied.
            after: What they led to [N, D].
        """
        moved = (after != states).any(axis=1)
        size = states.shape[1]
        if controls.shape[1] != size or moved.sum() < 2 * (size + 2):
            return None
        inputs = np.hstack([controls, np.ones((len(controls), 1))])[moved]
        changes, tolerance = (after - states)[moved], EXACT * max(1.0, float(np.abs(states).max()))
        weights: Array = np.zeros((size + 1, size))
        errors: Array = np.zeros(len(changes))
        for _ in range(ROUNDS):
            better = errors <= max(float(np.median(errors)), tolerance)
            weights = np.asarray(np.linalg.lstsq(inputs[better], changes[better], rcond=None)[0], np.float64)
            errors = np.abs(inputs @ weights - changes).max(axis=1)
        weights = np.round(weights, DECIMALS)
        gain, shift = weights[:-1], weights[-1]
        if (errors <= tolerance).mean() <= 0.5 or not np.linalg.cond(gain) < LARGEST_CONDITION:
            return None
        inverse = np.asarray(np.linalg.inv(gain), np.float64)
        drift = shift @ inverse
        low, high = model.action_low + drift, model.action_high + drift
        return cls(gain, inverse, low, high, drift, tolerance) if (low < 0.0).all() and (high > 0.0).all() else None

    def controls(self, states: Array, targets: Array, steps: Array) -> Array:
        """Return the controls [B, A] that lead from states straight to targets [B, D] in `steps` [B], from step one."""
        return np.clip((targets - states) @ self.inverse / steps[:, None], self.low, self.high) - self.drift

    def predicted(self, states: Array, controls: Array) -> Array:
        """Return where controls [B, A] lead from states [B, D]."""
        after: Array = states + (controls + self.drift) @ self.gain
        return after

    def is_free(self, states: Array, controls: Array, after: Array) -> BoolArray:
        """Return which controls [B] led where they lead where nothing is in the way."""
        free: BoolArray = np.abs(self.predicted(states, controls) - after).max(axis=1) <= self.tolerance
        return free

    def in_steps(self, states: Array) -> Array:
        """Return states [B, D] in coordinates in which a step leads by at most `low` and `high` along each axis."""
        coordinates: Array = states @ self.inverse
        return coordinates
