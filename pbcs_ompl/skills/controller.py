"""A skill chain as a controller: observation in, action out, and nothing of a simulator."""

from collections.abc import Sequence

import numpy as np

from pbcs_ompl.agents.policy import PolicyStack
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.skills.observed_sets import Entries, Entry
from pbcs_ompl.skills.policy import SkillPolicy


class ChainController:
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
        self._single = True
        self.current: IndexArray = np.zeros(1, dtype=np.int64)

    def reset(self, count: int | None = None) -> None:
        """Begin `count` episodes side by side; None for one, whose observations are vectors and not batches."""
        self._single = count is None
        self.current = np.zeros(1 if count is None else count, dtype=np.int64)

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
        chosen = np.arange(len(self.current)) if members is None else members
        if len(observations) != len(chosen):
            raise InvalidOption(f"got {len(observations)} observations for {len(chosen)} episodes; call reset(count)")
        self._switch(observations, chosen)
        actions = self._act(observations, self.current[chosen])
        return actions[0] if self._single else actions

    def _switch(self, observations: Array, members: IndexArray) -> None:
        self.current[members] = np.maximum(self.current[members], self._entries.last(observations))

    def _act(self, observations: Array, skills: IndexArray) -> Actions:
        seen = (observations - self._origins[skills]) / self._scales[skills]
        return self._actions.to_actions(self._policies.act(seen, skills))
