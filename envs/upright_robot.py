"""A body in a vertical plane as a `Robot`: gravity has one direction, so it is never turned, and looks nowhere."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.robot import Symmetry
from pbcs_ompl.core.types import Array, BoolArray


@dataclass(frozen=True, eq=False)
class UprightRobot:
    """State and observation begin with its place (x, z).

    Attributes:
        symmetries: See `Robot`.
    """

    symmetries: tuple[Symmetry, ...]
    place: tuple[int, int] = (0, 1)
    turning: float = 0.0

    @classmethod
    def of(cls, observation_size: int, action_size: int) -> "UprightRobot":
        """Return the robot of an environment with observations [O] and actions [A]."""
        return cls((Symmetry.identity(observation_size, action_size),))

    def heading(self, observations: Array) -> Array:
        """Return zeros [B]."""
        return np.zeros(len(observations))

    def fallen(self, observations: Array) -> BoolArray:
        """Return that none has fallen [B]: a crash ends the episode."""
        return np.zeros(len(observations), dtype=np.bool_)

    def turned(self, observations: Array, angles: Array) -> Array:
        """Return the observations [B, O] as they are: the world cannot be turned."""
        return observations.copy()

    def put(self, states: Array, places: Array, angles: Array) -> Array:
        """Return states [B, D] at places [B, 2], not turned."""
        moved = states.copy()
        moved[:, list(self.place)] = places
        return moved
