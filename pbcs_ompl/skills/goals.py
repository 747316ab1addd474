"""Where a skill ends and where it may start: balls around states, and the environment's own target."""

from dataclasses import dataclass
from typing import Protocol

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray


class Goal(Protocol):
    """A set of states, with a distance to its centre."""

    @property
    def radius(self) -> float:
        """The distance within which a state belongs to the goal."""
        ...

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the centre of the goal."""
        ...

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] lie in the goal."""
        ...


class ActivationSet(Goal, Protocol):
    """A set of states in which a skill may start: a `Ball` or a `ClassifierSet`. The skill before aims at it."""

    @property
    def center(self) -> Array:
        """The state in its middle [D]."""
        ...


@dataclass(frozen=True, eq=False)
class Ball:
    """The closed ball B_radius(center) by the environment's distance; [Matheron2020] section 7.2."""

    center: Array
    radius: float

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the centre."""
        return model.distance(states, self.center)

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] lie in the ball."""
        return self.distance(model, states) <= self.radius


@dataclass(frozen=True, eq=False)
class Target:
    """The environment's own goal: `goal_distance < goal_threshold`."""

    radius: float

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the environment's goal."""
        return model.goal_distance(states)

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] the environment calls a success."""
        return model.goal_distance(states) < self.radius
