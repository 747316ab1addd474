"""What moves in the plane of an environment, seen from a frame of its own: where it looks, and how it is symmetric."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray


@dataclass(frozen=True, eq=False)
class Symmetry:
    """A way to see a robot that is another one in the same world, and moves as the same one does.

    With the matrices M and N: where the action a leads from observation o to o', away from walls, the action N a leads
    from M o to M o'. The robot stays where it is.

    Attributes:
        observation: M [O, O].
        action: N [A, A], a permutation with signs.
    """

    observation: Array
    action: Array

    @classmethod
    def identity(cls, observation_size: int, action_size: int) -> "Symmetry":
        """Return the one that every robot has."""
        return cls(np.eye(observation_size), np.eye(action_size))


class Robot(Protocol):
    """What an environment declares of its robot, in its attribute `robot`: one policy serves all directions.

    Attributes:
        place: The entries of the observation that are its place (x, y); the explored feature begins with it.
        symmetries: Ways to see it, the identity first.
        turning: What a radian of its heading counts on lines, a length: a car that shall drive along a line has to look
            along it too, or against it, and its radius of turns is that length. 0 where places alone make a line.
    """

    place: tuple[int, int]
    symmetries: tuple[Symmetry, ...]
    turning: float

    def heading(self, observations: Array) -> Array:
        """Return the directions [B] in which it looks, in radians from the x axis; 0 where it has none."""
        ...

    def fallen(self, observations: Array) -> BoolArray:
        """Return which robots lie on the ground and should get up before they go on [B]; none where none can fall."""
        ...

    def turned(self, observations: Array, angles: Array) -> Array:
        """Return what observations [B, O] would be if the whole world were turned by angles [B] about the origin.

        A robot whose heading is always 0 is never turned.
        """
        ...

    def put(self, states: Array, places: Array, angles: Array) -> Array:
        """Return states [B, D] with the robot moved to places [B, 2] and turned by angles [B] about itself."""
        ...


PARTS = ("place", "symmetries", "turning", "heading", "fallen", "turned", "put")


def missing_parts(robot: object) -> list[str]:
    """Return what an attribute `robot` lacks of a `Robot`: environments call other things by that name."""
    return [name for name in PARTS if not hasattr(robot, name)]
