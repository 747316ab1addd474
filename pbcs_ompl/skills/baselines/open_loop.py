"""The plan without feedback."""

import numpy as np

from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.actions import Actions
from pbcs_ompl.skills.side_by_side import SideBySide


class OpenLoop(SideBySide):
    """Executes the actions of a plan one after the other, whatever is observed; then the last one again and again.

    Args:
        actions: Those of the plan [T, ...].
    """

    def __init__(self, actions: Actions):
        self._actions = actions
        self.reset()

    def _begin(self, count: int) -> None:
        self._steps = np.zeros(count, dtype=np.int64)

    def _act(self, observations: Array, members: IndexArray) -> Actions:
        chosen: Actions = self._actions[np.minimum(self._steps[members], len(self._actions) - 1)]
        self._steps[members] += 1
        return chosen
