"""Controls and actions: planners and agents work on boxes of real numbers, environments take members of their space."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pbcs_ompl.core.errors import UnsupportedSpace
from pbcs_ompl.core.types import Array

Actions = NDArray[Any]


@dataclass(frozen=True, eq=False)
class ActionMap:
    """What controls mean in an action space.

    A control is a point of a box [A]. Where actions are real numbers it is the action itself, rounded to the space's
    type and within its bounds. Where they are integers, each has an interval of length 1 around it, so that controls
    drawn uniformly give each integer with equal probability. An action of one `Discrete` is a number, [] and not [1].

    Attributes:
        first, last: The lowest and the highest action [A], in the type of the space.
        shape: That of an action.
    """

    first: Actions
    last: Actions
    shape: tuple[int, ...]

    @classmethod
    def of(cls, space: gymnasium.Space[Any]) -> Self:
        """Return that of a space.

        Args:
            space: A `Box` with finite bounds, `Discrete`, `MultiDiscrete` or `MultiBinary`; vectors or single numbers.

        Raises:
            UnsupportedSpace: another space; says the remedy.
        """
        return cls(*_range(space), tuple(space.shape or ()))

    @cached_property
    def low(self) -> Array:
        """Lower bounds of the controls [A]."""
        return self.first.astype(np.float64) - self._margin

    @cached_property
    def high(self) -> Array:
        """Upper bounds of the controls [A]."""
        return self.last.astype(np.float64) + self._margin

    @property
    def exact(self) -> bool:
        """Whether every control within the bounds is an action as it is."""
        return self.first.dtype == np.float64 and len(self.shape) == 1

    def to_actions(self, controls: Array) -> Actions:
        """Return the actions [B, *shape] for controls [B, A]; members of the space, fresh arrays."""
        values = np.array(controls, dtype=np.float64)
        if self._margin:
            values = np.floor(values + self._margin)
        first, last = self._bounds
        actions: Actions = np.minimum(np.maximum(values, first, out=values), last, out=values)
        if self.first.dtype != np.float64:  # rounding must not lead outside
            actions = np.minimum(np.maximum(actions.astype(self.first.dtype), self.first), self.last)
        return actions.reshape(len(values), *self.shape)

    def to_action(self, control: Array) -> Any:
        """Return the action for one control [A]."""
        return self.to_actions(np.asarray(control)[None])[0]

    def draw(self, rng: np.random.Generator) -> Any:
        """Return a random action: uniform in the box of controls."""
        return self.to_action(self.low + (self.high - self.low) * rng.random(len(self.first)))

    def to_controls(self, actions: Actions) -> Array:
        """Return controls [B, A] that give actions [B, *shape]."""
        return np.array(actions, dtype=np.float64).reshape(len(actions), len(self.first))

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        return self.first.astype(np.float64), self.last.astype(np.float64)

    @cached_property
    def _margin(self) -> float:
        return 0.5 if self.first.dtype.kind in "iub" else 0.0


def copied(action: Any) -> Any:
    """Return a copy of an action, for an environment that may change what it is given; numbers stay numbers."""
    return np.array(action)[()]


def _range(space: gymnasium.Space[Any]) -> tuple[Actions, Actions]:
    """Return the lowest and the highest action, as vectors of the space's type."""
    if isinstance(space, spaces.Discrete):
        return np.array([space.start], space.dtype), np.array([space.start + space.n - 1], space.dtype)
    if isinstance(space, spaces.MultiDiscrete) and space.nvec.ndim == 1:
        return np.array(space.start, space.dtype), np.array(space.start + space.nvec - 1, space.dtype)
    if isinstance(space, spaces.MultiBinary) and len(space.shape) == 1:
        return np.zeros(space.shape, space.dtype), np.ones(space.shape, space.dtype)
    if not isinstance(space, spaces.Box):
        raise UnsupportedSpace(f"action space {space}: expected a Box, Discrete, MultiDiscrete or MultiBinary; map one "
                               f"to these actions inside the environment")
    if len(space.shape) != 1:
        raise UnsupportedSpace(f"action space of shape {space.shape}: expected a vector; reshape it inside the "
                               f"environment")
    if not (np.isfinite(space.low).all() and np.isfinite(space.high).all()):
        raise UnsupportedSpace(f"action space {space}: expected finite bounds, since actions are sampled uniformly; "
                               f"give the Box finite low and high")
    return space.low, space.high
