"""Bounds of what an environment can show, from the environment or from a short random exploration."""

from typing import Any

import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.types import Array

MARGIN = 1.0
"""What random steps have not reached is expected within this many times their range."""


def feature_bounds(env: Any, steps: int) -> tuple[Array, Array, str]:
    """Return the bounds [F] of the feature of a `RestorableEnv`, and where they come from.

    Where the feature is the whole observation, and its space has finite bounds, these are taken. Else random
    steps, always the same, are made from `reset`, and the range they see is widened on both sides by itself.
    """
    given = env.feature_box()
    if given is not None:
        return *given, "the environment"
    first, _ = env.reset(seed=0)
    size = len(env.feature_dims)
    declared = _declared(env.inner.observation_space)
    rng = np.random.default_rng(0)
    space = env.action_space
    features, is_observation = [env.get_env_state()[:size]], _same(env.get_env_state()[:size], first)
    for _ in range(steps):
        observation, _, terminated, _, _ = env.step(rng.uniform(space.low, space.high).astype(space.dtype))
        features.append(env.get_env_state()[:size])
        is_observation = is_observation and _same(features[-1], observation)
        if terminated:
            env.reset(seed=int(rng.integers(2**31)))
    if is_observation and declared is not None:
        return *declared, "the observation space"
    seen = np.array(features)
    low, high = seen.min(axis=0), seen.max(axis=0)
    widen = np.maximum(MARGIN * (high - low), 1e-3)
    return low - widen, high + widen, f"{steps} random steps, widened"


def _declared(space: Any) -> tuple[Array, Array] | None:
    """Return the bounds of an observation space, if it has finite ones."""
    if not isinstance(space, Box):
        return None
    low, high = space.low.astype(np.float64).ravel(), space.high.astype(np.float64).ravel()
    return (low, high) if np.isfinite(high - low).all() else None


def _same(feature: Array, observation: Array) -> bool:
    """Return whether both are the same numbers; observations are often rounded to float32."""
    return np.array_equal(feature.astype(np.float32), observation.astype(np.float32))
