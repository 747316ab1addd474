"""The box that planners explore: from the environment, its observation space, its goals, else from random steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.observations import flat_bounds
from pbcs_ompl.resettable.rules import selected_dims

EXPLORED_STEPS = 500
RESETS = 30
MARGIN = 1.0
"""What random steps have not reached is expected within this many times their range."""
GOAL_MARGIN = 0.1
"""The box ends this part of its extent beyond the farthest goal."""
LEAST_RANGE = 1e-3
NARROW = 0.01
"""A dimension whose range in random steps is a smaller part of the largest one hardly moves."""
VALUES = 5
"""Two numbers are taken for the same one if they agree in that many different values."""


@dataclass(frozen=True)
class FeatureBounds:
    """The bounds of the feature.

    Attributes:
        low, high: They themselves [F].
        source: Where they come from, in words.
        narrow: Dimensions that random steps hardly move, and that nothing else says anything about.
    """

    low: Array
    high: Array
    source: str
    narrow: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Seen:
    """What resets and random steps have shown: features [N, F], observations [N, O], achieved and desired goals."""

    features: Array
    observations: Array
    achieved: Array | None
    desired: Array | None


def feature_bounds(env: Any) -> FeatureBounds:
    """Return the bounds of the feature of a `RestorableEnv`.

    Those of the environment where it has them. Else, for each dimension: where it is a number of the observation,
    whose space has finite bounds, these; else what random steps, always the same, reach from `reset`, widened on both
    sides by itself. Where the feature is the achieved goal, desired goals that resets have shown lie inside. Where
    random steps hardly move it, as a thing that they do not touch, so do places that resets have shown.
    """
    given = env.feature_box()
    if given is not None:
        return FeatureBounds(given[0], given[1], "the environment")
    seen = _explore(env)
    low, high = seen.features.min(axis=0), seen.features.max(axis=0)
    hardly = _narrow(high - low)
    if hardly.any():
        placed = _placed(env)
        low = np.where(hardly, np.minimum(low, placed.min(axis=0)), low)
        high = np.where(hardly, np.maximum(high, placed.max(axis=0)), high)
    extent = high - low
    widen = np.maximum(MARGIN * extent, LEAST_RANGE)
    low, high = low - widen, high + widen
    declared = _declared(seen, env.inner.observation_space, env.feature_rule)
    known = np.isfinite(declared[1] - declared[0])
    low, high = np.where(known, declared[0], low), np.where(known, declared[1], high)
    goals = _goals(seen)
    extended = ~known & np.isfinite(goals[0]) & ((goals[0] < low) | (goals[1] > high))
    beyond = GOAL_MARGIN * (np.fmax(high, goals[1]) - np.fmin(low, goals[0]))
    low = np.where(extended, np.fmin(low, goals[0] - beyond), low)
    high = np.where(extended, np.fmax(high, goals[1] + beyond), high)
    narrow = ~known & ~extended & _narrow(extent)
    return FeatureBounds(low, high, _source(known, extended), tuple(np.flatnonzero(narrow).tolist()))


def _narrow(extent: Array) -> BoolArray:
    """Return which dimensions hardly move, of the ranges [F] of all."""
    hardly: BoolArray = extent < np.maximum(LEAST_RANGE, NARROW * extent.max())
    return hardly


def _placed(env: Any) -> Array:
    """Return the features [N, F] where episodes begin."""
    features = []
    for seed in range(RESETS):
        env.reset(seed=seed)
        features.append(env.get_env_state()[:len(env.feature_dims)])
    return np.array(features)


def narrow_words(bounds: FeatureBounds) -> str:
    """Return what is to be said of dimensions that hardly move."""
    dims = ", ".join(map(str, bounds.narrow))
    return (f"random steps hardly move dimension {dims} of the feature, so its bounds are a guess; choose what is "
            f"explored with a feature rule")


def _source(known: BoolArray, extended: BoolArray) -> str:
    parts = ["the observation space"] if known.any() else []
    if not known.all():
        parts.append(f"{EXPLORED_STEPS} random steps, widened")
    return " and ".join(parts) + (", and the goals of resets" if extended.any() else "")


def _explore(env: Any) -> _Seen:
    rng = np.random.default_rng(0)
    actions = ActionMap.of(env.action_space)
    size = len(env.feature_dims)
    first, _ = env.reset(seed=0)
    features, observations, named = [env.get_env_state()[:size]], [first], [env.named]
    for _ in range(EXPLORED_STEPS):
        action = actions.to_action(rng.uniform(actions.low, actions.high))
        observation, _, terminated, truncated, _ = env.step(action)
        features.append(env.get_env_state()[:size])
        observations.append(observation)
        named.append(env.named)
        if terminated or truncated:
            env.reset(seed=int(rng.integers(2**31)))
    achieved, desired = _entries(named, "achieved_goal"), None
    if achieved is not None:
        for _ in range(RESETS):
            env.reset(seed=int(rng.integers(2**31)))
            named.append(env.named)
        desired = _entries(named, "desired_goal")
    return _Seen(np.array(features), np.array(observations), achieved, desired)


def _entries(named: list[Any], key: str) -> Array | None:
    """Return the vectors [N, G] of an entry of dictionaries; None where there is none."""
    if not all(isinstance(observation, dict) and key in observation for observation in named):
        return None
    return np.array([np.ravel(observation[key]) for observation in named], dtype=np.float64)


def _declared(seen: _Seen, space: Any, rule: str | None) -> tuple[Array, Array]:
    """Return the bounds [F] that the observation space has for the features; NaN where it has none."""
    low, high = flat_bounds(space)
    chosen = None if rule is None else selected_dims(rule, "obs", len(low))
    places = _columns(seen.features, seen.observations) if chosen is None else chosen
    return (np.array([np.nan if place is None else low[place] for place in places]),
            np.array([np.nan if place is None else high[place] for place in places]))


def _goals(seen: _Seen) -> tuple[Array, Array]:
    """Return the least and the greatest desired goal [F] of the features that are achieved goals, NaN for others."""
    size = seen.features.shape[1]
    if seen.achieved is None or seen.desired is None or seen.achieved.shape[1] != seen.desired.shape[1]:
        return np.full(size, np.nan), np.full(size, np.nan)
    places = _columns(seen.features, seen.achieved)
    low, high = seen.desired.min(axis=0), seen.desired.max(axis=0)
    return (np.array([np.nan if place is None else low[place] for place in places]),
            np.array([np.nan if place is None else high[place] for place in places]))


def _columns(features: Array, numbers: Array) -> Sequence[int | None]:
    """Return for each column of features [N, F] which of numbers [N, O] it is; None where it moves too little."""
    if features.shape == numbers.shape and _same(features, numbers):
        return range(features.shape[1])
    found: list[int | None] = []
    for column in features.T:
        moves = len(np.unique(column)) >= VALUES
        same = [place for place, other in enumerate(numbers.T) if moves and _same(column, other)]
        found.append(same[0] if same else None)
    return found


def _same(features: Array, numbers: Array) -> bool:
    """Return whether both are the same numbers; observations are often rounded to float32."""
    return np.array_equal(features.astype(np.float32), numbers.astype(np.float32))
