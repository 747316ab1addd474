"""How states become observations, where the environment says so itself or the observation is the state."""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.observations import flat, rounded
from pbcs_ompl.resettable.task_env import TaskEnv, bare

STEPS = 5
"""Random steps after which an observation is still the state, if it is."""
Observe = Callable[[Array], Array]


def state_observer(env: Any, offers: EnvAttributes) -> Observe | None:
    """Return what maps states [B, D] to the observations [B, O] that `env` makes in them; None where nothing does.

    Args:
        env: An environment with `get_env_state` and `set_env_state`; it is reset and stepped.
        offers: Its optional attributes.
    """
    observe = offers.observe
    if observe is not None:
        space = bare(env).observation_space
        return lambda states: _through(env, rounded(_vectors(observe(np.array(states, dtype=np.float64))), space))
    kind = observed_type(bare(env), reset_options(env))
    if kind is None:
        return None
    return lambda states: _through(env, np.array(states, dtype=np.float64).astype(kind).astype(np.float64))


def missing_observe(env: Any) -> NotResettable:
    """Return the error for an environment whose states cannot be observed."""
    return NotResettable(f"{type(bare(env)).__name__}: the observation is not the state, so implement "
                         f"`observe(states [B, D]) -> observations [B, O]`")


def reset_options(env: Any) -> dict[str, Any] | None:
    """Return what the resets of `env` get as options."""
    return env.reset_options if isinstance(env, TaskEnv) else None


def observed_type(env: Any, options: dict[str, Any] | None = None) -> np.dtype[Any] | None:
    """Return the type of numbers in which the observation is the state, at a reset and after some steps; else None."""
    observation, _ = env.reset(seed=0, options=options)
    kind = _type(observation, env.get_env_state())
    actions = deepcopy(env.action_space)
    actions.seed(0)
    for _ in range(STEPS):
        if kind is None:
            return None
        try:
            observation, _, terminated, truncated, _ = env.step(actions.sample())
        except Exception:  # what raises in steps is reported where steps are made
            return kind
        found = _type(observation, env.get_env_state())
        if found is None or found != kind:  # None == np.dtype(np.float64)
            return None
        if terminated or truncated:
            break
    return kind


def _type(observation: Any, state: Any) -> np.dtype[Any] | None:
    """Return the type of numbers of an observation that is the state, rounded if it has a shorter type; else None."""
    seen, numbers = flat(observation), np.array(state, dtype=np.float64)
    if seen.shape != numbers.shape:
        return None
    kinds = {kind for kind in _leaf_types(observation) if kind.kind == "f"}
    kind = kinds.pop() if len(kinds) == 1 else np.dtype(np.float64)
    return kind if np.array_equal(numbers.astype(kind), seen.astype(kind)) else None


def _leaf_types(observation: Any) -> list[np.dtype[Any]]:
    inner = observation.values() if isinstance(observation, dict) else observation
    if isinstance(observation, dict | tuple):
        return [kind for part in inner for kind in _leaf_types(part)]
    return [np.asarray(observation).dtype]


def _vectors(observed: Any) -> Array:
    """Return observations of a batch as rows: those of a dictionary side by side, in the order of their names."""
    if isinstance(observed, dict):
        rows = [_vectors(observed[key]) for key in sorted(observed)]
    elif isinstance(observed, tuple):
        rows = [_vectors(part) for part in observed]
    else:
        given = np.asarray(observed, dtype=np.float64)
        return given.reshape(len(given), int(np.prod(given.shape[1:])))  # -1 is refused for no rows
    return np.concatenate(rows, axis=1)


def _through(env: Any, vectors: Array) -> Array:
    return env.seen_batch(vectors) if isinstance(env, TaskEnv) else vectors
