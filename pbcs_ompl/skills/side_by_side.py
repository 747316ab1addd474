"""A controller of one episode or of several side by side; what it does in them is up to subclasses."""

from abc import ABC, abstractmethod

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.actions import Actions


class SideBySide(ABC):
    """Takes observations of one episode or of a batch of them, and gives actions in the same shape."""

    _single, _count = True, 1

    def reset(self, count: int | None = None) -> None:
        """Begin `count` episodes side by side; None for one, whose observations are vectors and not batches."""
        self._single, self._count = count is None, 1 if count is None else count
        self._begin(self._count)

    def act(self, observation: Array, members: IndexArray | None = None) -> Actions:
        """Return actions, members of the action space.

        Args:
            observation: Observations [B, O], entries of dictionaries one after the other by their names; [O] of a
                single episode.
            members: Which episodes they are of [B]; None for all, in order.

        Raises:
            InvalidOption: another number of observations than of episodes.
        """
        observations = np.asarray(observation, dtype=np.float64).reshape(1, -1) if self._single else observation
        chosen = np.arange(self._count) if members is None else members
        if len(observations) != len(chosen):
            raise InvalidOption(f"got {len(observations)} observations for {len(chosen)} episodes; call reset(count)")
        actions = self._act(observations, chosen)
        return actions[0] if self._single else actions

    @abstractmethod
    def _begin(self, count: int) -> None:
        """Begin `count` episodes."""

    @abstractmethod
    def _act(self, observations: Array, members: IndexArray) -> Actions:
        """Return the actions [B, ...] of some episodes [B] for their observations [B, O]."""
