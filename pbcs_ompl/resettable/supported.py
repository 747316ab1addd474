"""What the toolkit can work with: vector spaces, and wrappers below which states and actions mean the same."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from pbcs_ompl.core.errors import NotResettable, UnsupportedSpace


def check_observations(env: gymnasium.Env) -> None:
    """Refuse observations that are no vector Box.

    Raises:
        UnsupportedSpace: says the remedy.
    """
    observation = env.observation_space
    _refuse_pixels(observation)
    if isinstance(observation, spaces.Dict | spaces.Tuple):
        raise UnsupportedSpace(f"observation space {type(observation).__name__}: expected a vector Box; "
                               f"flatten it inside the environment (gymnasium.spaces.flatten)")
    if not isinstance(observation, spaces.Box) or len(observation.shape) != 1:
        raise UnsupportedSpace(f"observation space {observation}: expected a vector Box")


def check_flattenable(env: gymnasium.Env) -> None:
    """Refuse observations that cannot be flattened: the adapters of families do so with dictionaries of Boxes.

    Raises:
        UnsupportedSpace: says the remedy.
    """
    observation = env.observation_space
    parts = observation.spaces.values() if isinstance(observation, spaces.Dict) else [observation]
    for part in parts:
        _refuse_pixels(part)
    if not all(isinstance(part, spaces.Box) for part in parts):
        raise UnsupportedSpace(f"observation space {observation}: expected a Box, or a Dict of Boxes")


def _refuse_pixels(space: gymnasium.Space[Any]) -> None:
    if isinstance(space, spaces.Box) and space.dtype == np.uint8 and len(space.shape) >= 2:
        raise UnsupportedSpace(f"observation space {space.shape} of uint8: these are pixels, and the toolkit plans and "
                               f"trains on numbers of its state; make the environment with vector observations (an "
                               f"option such as obs_type='state' or 'ram'), or give it a wrapper-free `_get_obs` of them")


TRANSPARENT = frozenset({
    "TimeLimit", "PassiveEnvChecker", "OrderEnforcing", "Autoreset", "RecordEpisodeStatistics", "RecordVideo",
    "HumanRendering", "RenderCollection", "ClipReward", "NormalizeReward", "TransformReward",
})
"""Wrappers of limits, checks, records and rewards: planners and skills see the environment below them."""

WITH_MEMORY = frozenset({
    "FrameStackObservation", "NormalizeObservation", "StickyAction", "TimeAwareObservation",
    "DelayObservation", "MaxAndSkipObservation", "RepeatAction", "AtariPreprocessing", "AddWhiteNoise",
})


def unwrap(env: gymnasium.Env) -> gymnasium.Env[Any, Any]:
    """Return `env.unwrapped`, if no wrapper on the way changes what states, actions or observations mean.

    Raises:
        NotResettable: a wrapper would be lost; says the remedy.
    """
    while isinstance(env, gymnasium.Wrapper):
        name = type(env).__name__
        if name in WITH_MEMORY:
            raise NotResettable(
                f"the wrapper {name} has a memory or noise that a restored state would not bring back; leave "
                f"it out, or make its memory part of the environment's state"
            )
        if name not in TRANSPARENT:
            raise NotResettable(
                f"the wrapper {name} may change actions or observations, and the toolkit works below all "
                f"wrappers; pass env.unwrapped if that is meant, or build the change into the environment"
            )
        env = env.env
    return env
