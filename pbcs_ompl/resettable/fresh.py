"""Fresh environments of a task: made by Gymnasium from its id, or copied from an object before anything ran in it."""

import json
import warnings
from collections.abc import Callable
from contextlib import suppress
from copy import deepcopy
from typing import Any

import gymnasium
from gymnasium.utils import EzPickle
from gymnasium.wrappers import RepeatAction, TimeLimit

from pbcs_ompl.core.callbacks import describe
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.plain import plain
from pbcs_ompl.resettable.memory.owned import holds_resource

EnvMaker = Callable[[], gymnasium.Env[Any, Any]]
"""Makes an environment in which nothing has run yet, with all of its wrappers."""


def fresh_maker(env: gymnasium.Env[Any, Any], max_episode_steps: int | None = None) -> EnvMaker | None:
    """Return what makes environments equal to `env`; call it before anything runs in `env`.

    That is a deep copy of `env`, else Gymnasium from its registered id; None where neither works. An `EzPickle` is no
    copy, but made again from the arguments that its author has named, and Gymnasium knows all of them.

    Args:
        env: An environment, wrapped or not.
        max_episode_steps: The limit of episodes in place of that of `env`; None to leave it.
    """
    by_spec = _maker_by_spec(env, max_episode_steps)
    if holds_resource(env) or (by_spec is not None and isinstance(env.unwrapped, EzPickle)):
        return by_spec
    try:
        pristine = deepcopy(env)
        deepcopy(pristine)
    except Exception:  # whatever a foreign class raises when it is copied
        return by_spec
    return lambda: limited(deepcopy(pristine), max_episode_steps)


def _maker_by_spec(env: gymnasium.Env[Any, Any], max_episode_steps: int | None) -> EnvMaker | None:
    """Return what makes it by Gymnasium; None where its id, or the arguments of a wrapper, are not known."""
    spec = env.spec
    if spec is None or spec.id not in gymnasium.registry:
        return None
    if any(wrapper.kwargs is None for wrapper in spec.additional_wrappers):
        return None
    return lambda: limited(gymnasium.make(spec, disable_env_checker=True), max_episode_steps)


def close(env: gymnasium.Env[Any, Any]) -> None:
    """Close an environment; what it raises then is no more than a warning, because nothing depends on it."""
    try:
        env.close()
    except (Exception, SystemExit) as error:
        warnings.warn(f"the environment raised when it was closed: {describe(error)}", stacklevel=2)


def limited(env: gymnasium.Env[Any, Any], max_episode_steps: int | None) -> gymnasium.Env[Any, Any]:
    """Return `env` with episodes of that many steps; as it is for None."""
    if max_episode_steps is None:
        return env
    wrapper = _time_limit(env)
    if wrapper is None:
        return TimeLimit(env, max_episode_steps)
    wrapper._max_episode_steps = max_episode_steps
    return env


def episode_limit(env: gymnasium.Env[Any, Any]) -> int | None:
    """Return after how many steps a wrapper of `env` cuts an episode off; None where none does."""
    repeats = 1
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, TimeLimit):
            return -(-env._max_episode_steps // repeats)
        if isinstance(env, RepeatAction):
            repeats *= env.num_repeats
        env = env.env
    return None


def _time_limit(env: gymnasium.Env[Any, Any]) -> TimeLimit[Any, Any] | None:
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, TimeLimit):
            return env
        env = env.env
    return None


def spec_of(env: gymnasium.Env[Any, Any]) -> EnvSpec:
    """Return the id and the options of an environment: those that differ from what its id is registered with.

    One that was not made by `gymnasium.make` has no id; its class's name stands in, from which it cannot be made again.
    Nor can one in wrappers that transform, whose names stand around its own.
    """
    name = type(env.unwrapped).__qualname__ if env.spec is None else env.spec.id
    for layer in getattr(env, "layers", ()):
        name = f"{_wrapper_name(layer)}({name})"
    if env.spec is None:
        return EnvSpec(name)
    registered = gymnasium.registry[env.spec.id].kwargs if env.spec.id in gymnasium.registry else {}
    return EnvSpec(name, {option: value for option, value in env.spec.kwargs.items() if option != "render_mode"
                          and (option not in registered or repr(value) != repr(registered[option]))})



def _wrapper_name(layer: Any) -> str:
    """Return a wrapper's class, with those of its arguments that are numbers, strings or arrays of them."""
    given = []
    for option, value in getattr(layer, "_saved_kwargs", {}).items():  # of gymnasium.utils.RecordConstructorArgs
        with suppress(TypeError, ValueError):
            given.append(f"{option}={json.dumps(value, default=plain, separators=(',', ':'))}")
    return type(layer).__name__ + (f"[{','.join(given)}]" if given else "")
