"""The states of a plan where episodes start and skills end."""

from dataclasses import dataclass, field

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.skills.activation_sets import Ball, EnvironmentGoal, Target
from pbcs_ompl.skills.path_following.line import fewest_hops
from pbcs_ompl.skills.policy import ObservationTransform
from pbcs_ompl.skills.settings import PlannedSettings, PlanSettings, StartSettings


@dataclass(frozen=True, eq=False)
class Waypoints:
    """States tau_0 ... tau_N, from the environment's start to its goal.

    Attributes:
        states: [N+1, D].
        model: The environment they belong to.
        starts: Radius of the balls around them, and how states are drawn there.
        reset_seed: The seed of the reset that leads to the first of them; None where none is known to.
        plan: How policies observe the world along them; the default is that of methods without a plan.
    """

    states: Array
    model: ResettableModel
    starts: StartSettings
    reset_seed: int | None = None
    plan: PlanSettings = field(default_factory=PlanSettings)

    @classmethod
    def of_plan(cls, states: Array, model: ResettableModel, settings: PlannedSettings,
                reset_seed: int | None = None) -> "Waypoints":
        """Return the waypoints along a plan, without loops if the settings say so.

        Args:
            states: Those of the plan [T+1, D].
            model: The environment.
            settings: Of the method.
            reset_seed: The seed of the reset that leads to the first state.
        """
        if settings.plan.remove_loops and len(states) > 2:
            states = states[remove_loops(model, states, settings.starts.radius)]
        return cls(states, model, settings.starts, reset_seed, settings.plan)

    @classmethod
    def at_start(cls, seed: int, model: ResettableModel, settings: StartSettings) -> "Waypoints":
        """Return the waypoints of a method without a plan: the start of an episode with `seed`, as first and last."""
        start = model.initial_state(seed)
        return cls(np.stack([start, start]), model, settings, model.spec.reset_seed(seed))

    @property
    def last(self) -> int:
        """The index N of the last state."""
        return len(self.states) - 1

    def ball(self, index: int) -> Ball:
        """Return B(tau_index)."""
        return Ball(self.states[index], self.starts.radius)

    def target(self, index: int) -> Target:
        """Return where a skill that ends at `index` leads: the environment's goal at the end, else a ball."""
        if index == self.last:
            return EnvironmentGoal(self.model.goal_threshold)
        return self.ball(index)

    def near(self, index: int) -> IndexArray:
        """Return the waypoints whose states lie in the ball of `index`, itself among them."""
        return np.flatnonzero(self.ball(index).contains(self.model, self.states))

    def transform(self, index: int) -> ObservationTransform:
        """Return how a skill that ends at `index` observes the world."""
        if not self.plan.relative_observations:
            return ObservationTransform.identity(self.model.observation_size)
        return ObservationTransform.relative(self.model.observe(self.states[index:index + 1])[0],
                                             self.model.observe(self.states), self.plan.observation_horizon)

    def draw_starts(self, indices: IndexArray, rng: np.random.Generator, counter: Counter | None = None) -> Array:
        """Draw one start state of an episode for each index: in its ball, or its state where starts are exact.

        See `draw_near` for arguments and result.
        """
        return self.states[indices] if self.starts.exact else self.draw_near(indices, rng, counter)

    def draw_near(self, indices: IndexArray, rng: np.random.Generator, counter: Counter | None = None) -> Array:
        """Draw one state in the ball of each index.

        Args:
            indices: Waypoints [B].
            rng: Source of random numbers.
            counter: Counts the steps that this takes, if any.

        Returns:
            States [B, D].
        """
        draws = np.empty((len(indices), self.states.shape[1]))
        for index in np.unique(indices):
            mine = indices == index
            before = self.states[max(0, index - self.plan.preceding_waypoints):index]
            draws[mine] = self.model.perturb(self.states[index], self.starts.radius, int(mine.sum()), rng,
                                             reject_invalid=self.starts.reject_invalid, before=before,
                                             rollout_steps=self.starts.rollout_steps, counter=counter)
        return draws


def remove_loops(model: ResettableModel, states: Array, gap: float) -> IndexArray:
    """Return the indices [M] of the path with the fewest hops along `states` from the first to the last.

    A hop leads from a state to the next one, or to any later state within `gap`. Exploration returns to places where
    it was before, and a hop leaves such a loop out; skills need states to start from, not controls between them, so a
    hop need not be a transition. With `gap` no larger than the activation radius, a hop is no longer than the distance
    at which one skill takes over from another anyway.

    Args:
        model: It knows distances.
        states: [T+1, D].
        gap: Longest hop, in the environment's distance.

    Source: `line.fewest_hops`. Not in [Matheron2020].
    """
    return fewest_hops(len(states), lambda index: model.distance(states[index + 1:], states[index]) <= gap)
