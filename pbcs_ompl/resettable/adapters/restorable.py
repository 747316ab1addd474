"""What every family's adapter makes of an environment: one with `get_env_state` and `set_env_state`."""

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Sequence
from copy import copy
from typing import Any, Self

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.errors import CallbackFailed
from pbcs_ompl.core.types import Array, Capability
from pbcs_ompl.resettable.actions import copied
from pbcs_ompl.resettable.feature_bounds import feature_bounds, narrow_words
from pbcs_ompl.resettable.observations import flat, has_goals
from pbcs_ompl.resettable.rules import (
    SUCCESS,
    FeatureRule,
    GoalRule,
    Outcome,
    feature_rule,
    goal_rule,
    reported_success,
    rule_text,
    selected_dims,
)
from pbcs_ompl.resettable.task_env import TaskEnv

GUARD_EVERY = 1024
"""Saved states between two looks at what is taken for constant."""
UNBOUNDED = 1e9
"""OMPL wants finite bounds. Dimensions that are not sampled get these."""


class RestorableEnv(gymnasium.Env[Array, Array], ABC):
    """A Gymnasium environment that can be restored; a family says how to save and load.

    Its state is [feature F | what `save` returns | distance to the goal]. The feature comes first, so it is a
    selection of state dimensions for OMPL, whatever computes it. The last number makes success a function of the
    state: it is the distance to the goal that the environment reports, else 0 in a success and 1 elsewhere.

    Args:
        inner: The environment without wrappers.
        goal: What a success is; by default what the environment reports (see `rules.reported_success`).
        feature: What planners explore; by default the family's choice.
    """

    capabilities: frozenset[Capability] = frozenset({"visited", "exact"})
    perturb_by_rollouts = True
    exploring = False
    """Whether steps are made only to see what range the feature has: no state of theirs is restored."""
    largest = UNBOUNDED
    """No number that is saved is larger."""
    reports_success: bool | None = None
    """Whether the environment reports in each step if it is a success; None where nothing was explored."""
    rewards_any_step = False
    """Whether exploration has seen a positive reward for a step that ended nothing."""
    goal_radius = 1.0
    """A state is a success if its distance to the goal is smaller, where the environment reports one."""

    def __init__(self, inner: Any, goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None):
        self.inner = inner
        self.goal_rule = None if goal is None else rule_text("goal", goal)
        self.feature_rule = None if feature is None else rule_text("feature", feature)
        self._is_success = reported_success if self.goal_rule is None else goal_rule(self.goal_rule)
        self._feature_of = self.default_feature() if self.feature_rule is None else feature_rule(self.feature_rule)
        self.spec = inner.spec
        self.render_mode = inner.render_mode
        self.action_space = inner.action_space
        self._head, self._distance = np.empty(0), 1.0
        self.has_goal_distance = False
        self._saves = 0
        self.named: Any = None
        observation, _ = self.reset(seed=0)
        self.observation_space = Box(-np.inf, np.inf, observation.shape, np.float64)
        self.goal_threshold = self.goal_radius if self.has_goal_distance else 0.5
        saved = len(self.save())
        self.feature_dims = tuple(range(len(self._head)))
        self.feature_periods = self._periods()
        self.exploring = True
        self.bounds = feature_bounds(self)
        self.exploring = False
        if self.bounds.narrow:
            warnings.warn(narrow_words(self.bounds), stacklevel=2)
        rest = np.full(saved + 1, self.largest)
        self.state_low = np.concatenate([self.bounds.low, -rest])
        self.state_high = np.concatenate([self.bounds.high, rest])
        self.reset(seed=0)

    def again(self, inner: Any) -> Self:
        """Return the adapter of another instance of the environment, without exploring that one."""
        other = copy(self)
        other.inner = inner
        other.attach()
        other.reset(seed=0)
        return other

    def attach(self) -> None:
        """Let what refers to the environment refer to `inner`."""

    @abstractmethod
    def save(self) -> Array:
        """Return everything needed to go on, as a vector of the same length at any time."""

    @abstractmethod
    def load(self, saved: Array) -> None:
        """Go back to what `save` returned.

        Raises:
            InvalidState: the environment cannot go there.
        """

    @abstractmethod
    def observation(self) -> Any:
        """Return what the environment within the wrappers observes in the present state."""

    def seen(self, observation: Any) -> Any:
        """Return what the wrappers make of what `observation` returned."""
        return self.inner.seen(observation) if isinstance(self.inner, TaskEnv) else observation

    def default_feature(self) -> FeatureRule:
        """Return what planners explore unless the user says otherwise: the achieved goal where there is one."""
        return feature_rule("achieved_goal" if has_goals(self.inner) else "obs")

    def reported_goal_distance(self, observation: Any) -> float | None:
        """Return the distance to the goal that an observation of `inner` shows; None where it shows none."""
        return None

    def angles(self) -> tuple[str, int, Sequence[int]]:
        """Return a source of numbers (see `rule_language`), how many it has, and which are angles that turn freely."""
        return "state", 0, ()

    def usual_rule(self) -> str | None:
        """Return what planners explore unless the user says otherwise, as a rule, where it is one."""
        return None

    def _periods(self) -> Array:
        """Return the period of each feature [F]: 2 pi for an angle that turns freely, else 0."""
        source, size, angles = self.angles()
        rule = self.usual_rule() if self.feature_rule is None else self.feature_rule
        dims = None if rule is None else selected_dims(rule, source, size)
        if dims is None:
            return np.zeros(len(self._head))
        return np.array([2.0 * np.pi if dim in angles else 0.0 for dim in dims])

    def feature_box(self) -> tuple[Array, Array] | None:
        """Return the bounds [F] of the feature; None where they have to be explored."""
        return None

    def named_state(self, env: Any) -> dict[str, Any]:
        """Return the parts of the state of an environment like `inner`, by name, to compare them; empty if unknown."""
        return {}

    def check_constants(self) -> None:
        """Refuse the environment if something has changed that is no part of the state that is saved.

        Raises:
            NotResettable: says what.
        """

    def is_success(self, outcome: Outcome) -> bool:
        """Return whether an outcome is a success."""
        return bool(self._is_success(outcome))

    @property
    def goal_is_unknown(self) -> bool:
        """Whether neither what the environment reports nor the reward of a last step says what a success is."""
        return self.goal_rule is None and self.reports_success is False and self.rewards_any_step

    def difference(self, states: Array, others: Array) -> Array:
        """Return the differences [B, K] between saved states [B, S] that `distance` measures, before features."""
        return np.empty((len(states), 0))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Reset the environment."""
        observation, info = self.inner.reset(seed=seed, options=options)
        self._store(Outcome(self.inner, observation, math.nan, False, info))
        return flat(observation), info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Make one step of the environment."""
        observation, reward, terminated, truncated, info = self.inner.step(copied(action))
        success = self._store(Outcome(self.inner, observation, float(reward), bool(terminated), info))
        return flat(observation), float(reward), bool(terminated), bool(truncated), {**info, "is_success": success}

    def get_env_state(self) -> Array:
        """Return the state [D].

        Raises:
            NotResettable: something has changed that is no part of it; this is looked at now and then.
        """
        self._saves += 1
        if self._saves % GUARD_EVERY == 0:
            self.check_constants()
        features, saved = len(self._head), self.save()
        state = np.empty(features + len(saved) + 1)
        state[:features], state[features:-1], state[-1] = self._head, saved, self._distance
        return state

    def set_env_state(self, state: Array) -> None:
        """Go back to a state [D].

        Raises:
            InvalidState: the environment cannot go there.
        """
        features = len(self.feature_dims)
        self._head, self._distance = np.array(state[:features]), float(state[-1])
        self.load(np.array(state[features:-1], dtype=np.float64))

    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] of states [B, D]."""
        rows = np.empty((len(states), *self.observation_space.shape))  # type: ignore[misc]
        for row, state in zip(rows, states, strict=True):
            self.set_env_state(state)
            row[:] = flat(self.seen(self.observation()))
        return rows

    def goal_distance(self, states: Array) -> Array:
        """Return the distances to the goal [B], as they were reported when the states were reached."""
        return np.array(states, dtype=np.float64)[:, -1]

    def distance(self, states: Array, others: Array) -> Array:
        """Return the lengths [B] of the differences between states, for activation sets.

        Where a family knows no difference of its own, those of the features, in units in which the extent of each is 2,
        as in the smallest maze: positions and speeds then weigh alike.
        """
        states, others = np.asarray(states), np.broadcast_to(others, np.shape(states))
        features = len(self.feature_dims)
        saved = self.difference(states[:, features:-1], others[:, features:-1])
        if saved.shape[1] == 0:
            extent = self.state_high[:features] - self.state_low[:features]
            saved = (states[:, :features] - others[:, :features]) * (2.0 / extent)
        lengths: Array = np.linalg.norm(saved, axis=1)
        return lengths

    def render(self) -> Any:
        """Render the environment."""
        return self.inner.render()

    def close(self) -> None:
        """Close the environment."""
        self.inner.close()

    def _store(self, outcome: Outcome) -> bool:
        """Keep feature and distance of what was reached; return whether it is a success."""
        self.named = self.inner.kept.last if isinstance(self.inner, TaskEnv) else outcome.observation
        self._head = np.asarray(self._feature_of(Outcome(*outcome[:-1], self.named)), dtype=np.float64).reshape(-1)
        if not len(self._head):
            raise CallbackFailed("the feature function returned no numbers")
        success = self.is_success(outcome)
        if self.exploring:
            self.reports_success = bool(self.reports_success) or any(key in outcome.info for key in SUCCESS)
            self.rewards_any_step |= outcome.reward > 0.0 and not outcome.terminated
        reported = None if self.goal_rule is not None else self.reported_goal_distance(self.named)
        self.has_goal_distance = reported is not None
        if reported is None:
            self._distance = 0.0 if success else 1.0
        else:
            below = np.nextafter(self.goal_radius, 0.0)
            self._distance = min(reported, below) if success else max(reported, self.goal_radius)
        return success
