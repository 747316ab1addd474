"""The states of a plan along which skills are trained."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.skills.goals import Ball, Goal, Target
from pbcs_ompl.skills.policy import Frame
from pbcs_ompl.skills.settings import SkillSettings
from pbcs_ompl.skills.shorten import shorten

BEFORE = 5
"""Milestones before a start point from which random rollouts may arrive in its ball."""


@dataclass(frozen=True, eq=False)
class Milestones:
    """States tau_0 ... tau_N, from the environment's start to its target.

    Attributes:
        states: [N+1, D].
        model: The environment they belong to.
        settings: Radius of the balls, kind of frame.
    """

    states: Array
    model: ResettableModel
    settings: SkillSettings

    @classmethod
    def of_plan(cls, states: Array, model: ResettableModel, settings: SkillSettings) -> "Milestones":
        """Return the milestones along the `states` [T+1, D] of a plan, without detours if the settings say so."""
        if settings.shorten and len(states) > 2:
            states = states[shorten(model, states, settings.radius)]
        return cls(states, model, settings)

    @property
    def last(self) -> int:
        """The index N of the last state."""
        return len(self.states) - 1

    def ball(self, index: int) -> Ball:
        """Return B(tau_index)."""
        return Ball(self.states[index], self.settings.radius)

    def goal(self, index: int) -> Goal:
        """Return where a skill that ends at `index` leads: the environment's target at the end, else a ball."""
        if index == self.last:
            return Target(self.model.goal_threshold)
        return self.ball(index)

    def near(self, index: int) -> IndexArray:
        """Return the milestones whose states lie in the ball of `index`, itself among them."""
        return np.flatnonzero(self.ball(index).contains(self.model, self.states))

    def frame(self, index: int) -> Frame:
        """Return the frame of observations for a skill that ends at `index`."""
        if not self.settings.relative_observations:
            return Frame.plain(self.model.observation_size)
        return Frame.around(self.model.observe(self.states[index:index + 1])[0], self.model.observe(self.states))

    def starts(self, indices: np.ndarray, rng: np.random.Generator, counter: Counter | None = None) -> Array:
        """Draw one start state [D] in the ball of each index [B]; count the steps that this takes, if any."""
        draws = np.empty((len(indices), self.states.shape[1]))
        for index in np.unique(indices):
            mine = indices == index
            draws[mine] = self.model.perturb(self.states[index], self.settings.radius, int(mine.sum()), rng,
                                             reject_invalid=self.settings.reject_invalid,
                                             before=self.states[max(0, index - BEFORE):index], counter=counter)
        return draws
