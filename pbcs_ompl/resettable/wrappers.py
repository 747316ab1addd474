"""Which wrappers may be removed: those below which states, actions and observations mean the same."""

from typing import Any

import gymnasium

from pbcs_ompl.core.errors import NotResettable

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
