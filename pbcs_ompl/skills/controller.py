"""A skill chain as a controller: observation in, action out, and nothing of a simulator."""

from collections.abc import Sequence

import numpy as np

from pbcs_ompl.agents.policy import PolicyStack
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.skills.observed_sets import Entries, Entry
from pbcs_ompl.skills.policy import SkillPolicy
from pbcs_ompl.skills.side_by_side import SideBySide


class ChainController(SideBySide):
    """Switches to a later skill as soon as its entry is observed, and never goes back.

    Example:
        >>> controller = chain.controller()
        >>> controller.reset()
        >>> observation, info = env.reset()
        >>> observation, *rest = env.step(controller.act(observation))

    Attributes:
        current: The index of the skill that each episode is in [B].

    Args:
        policies: Those of the skills, in the order of execution.
        entries: Where each of them takes over.
        actions: The action space.

    Raises:
        InvalidOption: there is no skill.
    """

    def __init__(self, policies: Sequence[SkillPolicy], entries: Sequence[Entry], actions: ActionMap):
        if not policies:
            raise InvalidOption("the skill chain is empty")
        self._policies, self._entries, self._actions = (
            PolicyStack([policy.actor for policy in policies]), Entries(entries), actions)
        self._origins = np.array([policy.transform.origin for policy in policies])
        self._scales = np.array([policy.transform.scale for policy in policies])
        self.current: IndexArray = np.zeros(1, dtype=np.int64)

    def _begin(self, count: int) -> None:
        self.current = np.zeros(count, dtype=np.int64)

    def _act(self, observations: Array, members: IndexArray) -> Actions:
        self.current[members] = np.maximum(self.current[members], self._entries.last(observations))
        skills = self.current[members]
        seen = (observations - self._origins[skills]) / self._scales[skills]
        return self._actions.to_actions(self._policies.act(seen, skills))
