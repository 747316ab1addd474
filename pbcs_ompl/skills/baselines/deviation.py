"""How far observations are from those of a plan."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray

JUMP = 5.0
"""An entry within [-pi, pi] that moves by more than this in a step of the plan is an angle that wraps round."""


@dataclass(frozen=True, eq=False)
class Deviation:
    """Differences of observations in their standard deviations along a plan, angles the short way round.

    Attributes:
        scale: The standard deviations [O]; 1 where an entry is constant.
        angles: Which entries are angles [O].
    """

    scale: Array
    angles: BoolArray

    @classmethod
    def along(cls, observations: Array) -> "Deviation":
        """Return that of a plan with these observations [T+1, O]."""
        spread = observations.std(axis=0)
        jumps = np.abs(np.diff(observations, axis=0)).max(axis=0, initial=0.0)
        within = np.abs(observations).max(axis=0) <= np.pi + 1e-9
        return cls(np.where(spread > 1e-9, spread, 1.0), within & (jumps > JUMP))

    def __call__(self, observations: Array, references: Array) -> Array:
        """Return the differences [..., O] of observations from references of the same shape."""
        difference = np.asarray(observations, dtype=np.float64) - references
        turned = difference[..., self.angles]
        difference[..., self.angles] = np.mod(turned + np.pi, 2.0 * np.pi) - np.pi
        deviation: Array = difference / self.scale
        return deviation
