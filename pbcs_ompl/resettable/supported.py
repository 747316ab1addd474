"""What the toolkit can work with: observations that are vectors of numbers, wrappers that only transform."""

from collections.abc import Callable
from copy import copy
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from pbcs_ompl.core.errors import NotResettable, UnsupportedSpace
from pbcs_ompl.core.interfaces import GetSetEnv
from pbcs_ompl.resettable.fresh import EnvMaker
from pbcs_ompl.resettable.observations import parts
from pbcs_ompl.resettable.pure import check_pure
from pbcs_ompl.resettable.task_env import Kept, TaskEnv

TaskMaker = Callable[[], Any]
"""Makes fresh instances of what adapters work on: what `task_env` makes of fresh environments."""
NUMBERS = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)
DROPPED = frozenset({"TimeLimit", "PassiveEnvChecker", "OrderEnforcing", "Autoreset", "RecordEpisodeStatistics",
                     "RecordVideo", "HumanRendering", "RenderCollection"})
"""Wrappers of limits, checks and records: restored states are stepped below them."""
WITH_MEMORY = frozenset({"FrameStackObservation", "NormalizeObservation", "NormalizeReward", "StickyAction",
                         "TimeAwareObservation", "DelayObservation", "MaxAndSkipObservation", "AtariPreprocessing",
                         "AddWhiteNoise", "ObstructView"})
WITHOUT_MEMORY = frozenset({"RepeatAction"})
Wrapper = gymnasium.Wrapper[Any, Any, Any, Any]
TRANSFORMS = (gymnasium.ObservationWrapper, gymnasium.ActionWrapper, gymnasium.RewardWrapper)


def check_observations(env: gymnasium.Env[Any, Any]) -> None:
    """Refuse observations that cannot be made a vector of numbers (see `observations.flat`), and pictures.

    Raises:
        UnsupportedSpace: says the remedy.
    """
    space = env.observation_space
    for part in parts(space):
        if not isinstance(part, NUMBERS):
            raise UnsupportedSpace(f"observation space {space}: expected boxes, discrete values, or a Dict or Tuple of "
                                   f"these; leave out {type(part).__name__} (gymnasium.wrappers.FilterObservation)")
        if isinstance(part, spaces.Box) and part.dtype == np.uint8 and len(part.shape) >= 2:
            raise UnsupportedSpace(f"observations are pictures of shape {part.shape}: expected vectors of numbers, "
                                   f"such as the state; planners and skills do not learn from pixels")


def is_vector_box(space: gymnasium.Space[Any]) -> bool:
    """Return whether observations are vectors as they are."""
    return isinstance(space, spaces.Box) and len(space.shape) == 1


def task_env(env: gymnasium.Env[Any, Any], reset_options: dict[str, Any] | None = None) -> Any:
    """Return what adapters work on: the environment within the wrappers, in a `TaskEnv` where one is needed.

    Wrappers that transform actions, observations or rewards are copied around it, those of limits, checks and records
    are left out, and one with `get_env_state` and `set_env_state` is taken for the environment itself.

    Args:
        env: The environment with all of its wrappers, which stay as they are.
        reset_options: What resets get that are given no options.

    Raises:
        NotResettable: a wrapper has a memory, or may have one; says the remedy.
        UnsupportedSpace: an observation is no vector of numbers.
    """
    kept: list[Wrapper] = []
    inner = env
    while isinstance(inner, gymnasium.Wrapper) and not _restores(inner):
        if not _is_dropped(inner):
            _check_kind(inner)
            kept.append(inner)
        inner = inner.env
    inner = _without_dropped(inner)
    within = Kept(inner)
    layers: list[Wrapper] = []
    top: Wrapper = within
    for wrapper in reversed(kept):
        layer = copy(wrapper)
        layer.env = top
        layers.append(layer)
        top = layer
    flatten = isinstance(inner, GetSetEnv) and not is_vector_box(top.observation_space) and not _is_goal_env(inner)
    check_observations(top)
    if not layers and not flatten and reset_options is None:
        return inner
    task = TaskEnv(top, tuple(layers), within, env.spec, reset_options=reset_options, flatten=flatten)
    check_pure(task)
    return task


def task_maker(make_env: EnvMaker | None, reset_options: dict[str, Any] | None = None) -> TaskMaker | None:
    """Return what makes fresh instances of what adapters work on, from what makes the environment with its wrappers."""
    return None if make_env is None else lambda: task_env(make_env(), reset_options)


def _restores(env: Any) -> bool:
    return isinstance(env, GetSetEnv)


def _is_goal_env(env: Any) -> bool:
    """Return whether the simulator's adapter works on `env`; it reads achieved and desired goals by their names."""
    return hasattr(env, "model") and hasattr(env, "data")


def _without_dropped(env: gymnasium.Env[Any, Any]) -> Any:
    """Return `env`, below whose outermost wrapper nothing counts steps."""
    if not isinstance(env, gymnasium.Wrapper):
        return env
    if _is_dropped(env):
        return _without_dropped(env.env)
    same = copy(env)
    same.env = _without_dropped(env.env)
    return same


def _is_dropped(wrapper: Wrapper) -> bool:
    if _is_of_gymnasium(type(wrapper)):
        return type(wrapper).__name__ in DROPPED
    return not isinstance(wrapper, TRANSFORMS) and not _overridden(wrapper)


def _overridden(wrapper: Wrapper) -> list[str]:
    """Return which of the methods that make an episode are not Gymnasium's own."""
    return [name for name in ("reset", "step") if not getattr(type(wrapper), name).__module__.startswith("gymnasium.")]


def _is_of_gymnasium(kind: type) -> bool:
    return kind.__module__.startswith("gymnasium.")


def _check_kind(wrapper: Wrapper) -> None:
    """Refuse a wrapper that is known to have a memory, or may have one."""
    name, known = type(wrapper).__name__, _is_of_gymnasium(type(wrapper))
    if known and name in WITH_MEMORY:
        raise NotResettable(f"the wrapper {name} has a memory or noise that a restored state would not bring back; "
                            f"leave it out, or make its memory part of the environment's state")
    if known and name in WITHOUT_MEMORY:
        return
    overridden = _overridden(wrapper)
    if not isinstance(wrapper, TRANSFORMS) or (overridden and not known):
        what = f"overrides {' and '.join(overridden)}" if overridden else "is none of those that only transform"
        raise NotResettable(f"the wrapper {name} {what}, so it may have a memory; derive it from "
                            f"gymnasium.ObservationWrapper, ActionWrapper or RewardWrapper if it only transforms, give "
                            f"it get_env_state and set_env_state, or build the change into the environment")
