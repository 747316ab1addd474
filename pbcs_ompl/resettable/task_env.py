"""An environment as the task has it: seen through the wrappers that transform, reset with the task's options."""

from copy import deepcopy
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.observations import flat, flat_bounds, unflat

BATCHED = frozenset({"transition", "step_one", "compiled_step", "advance_towards"})
"""What works on controls below all wrappers."""
OWN = frozenset({"bare", "top", "layers", "kept", "flatten", "_options", "reset_options", "spec", "render_mode",
                 "metadata", "action_space", "observation_space"})


class Kept(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Keeps the last observation below the wrappers that transform it: goals are found in it by their names."""

    last: Any = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset the environment."""
        self.last, info = self.env.reset(seed=seed, options=options)
        return self.last, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Make one step of the environment."""
        self.last, reward, terminated, truncated, info = self.env.step(action)
        return self.last, reward, terminated, truncated, info


class TaskEnv(gymnasium.Env[Any, Any]):
    """The environment within its wrappers.

    `reset` and `step` go through the wrappers; every other attribute, the state among them, is that of the environment
    within. Wrappers of limits, checks and records are not there, so that nothing counts steps across restored states.

    Args:
        top: The outermost of the wrappers that are kept, else the environment itself.
        layers: These wrappers, the innermost first.
        kept: The environment within, between it and the wrappers.
        spec: What Gymnasium makes the whole from.
        reset_options: What a reset gets that is given no options.
        flatten: Return observations as vectors.
    """

    def __init__(self, top: gymnasium.Env[Any, Any], layers: tuple[gymnasium.Wrapper[Any, Any, Any, Any], ...],
                 kept: Kept, spec: Any, *, reset_options: dict[str, Any] | None = None,
                 flatten: bool = False):
        self.bare, self.top, self.layers, self.kept = kept.env, top, layers, kept
        self.spec, self.render_mode, self.metadata = spec, kept.render_mode, kept.metadata
        self._options, self.flatten = reset_options, flatten
        self.action_space = explored_actions(top)
        self.observation_space: Any = top.observation_space
        if flatten:
            self.observation_space = flat_space(top.observation_space)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset the environment."""
        observation, info = self.top.reset(seed=seed, options=deepcopy(self._options if options is None else options))
        return self._shaped(observation), info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Make one step of the environment."""
        observation, reward, terminated, truncated, info = self.top.step(action)
        return self._shaped(observation), reward, terminated, truncated, info

    @property
    def reset_options(self) -> dict[str, Any] | None:
        """What a reset gets that is given no options: a copy, because the environment may change it."""
        return deepcopy(self._options)

    def seen(self, observation: Any) -> Any:
        """Return what the wrappers make of an observation of the environment within."""
        for layer in self.layers:
            if isinstance(layer, gymnasium.ObservationWrapper):
                observation = layer.observation(observation)
        return self._shaped(observation)

    def seen_batch(self, vectors: Array) -> Array:
        """Return what the wrappers make of observations [B, O] of the environment within, given as vectors."""
        if not any(isinstance(layer, gymnasium.ObservationWrapper) for layer in self.layers):
            return vectors
        space = self.bare.observation_space
        rows = [flat(self.seen(unflat(vector, space))) for vector in vectors]
        return np.array(rows).reshape(len(vectors), -1)

    def render(self) -> Any:
        """Render the environment."""
        return self.bare.render()

    def close(self) -> None:
        """Close the environment."""
        self.bare.close()

    @property
    def unwrapped(self) -> Any:
        """The environment within."""
        return self.bare.unwrapped

    @property
    def np_random(self) -> np.random.Generator:
        """The random generator of the environment within."""
        return self.bare.np_random

    @np_random.setter
    def np_random(self, value: np.random.Generator) -> None:
        self.bare.np_random = value

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name in OWN or (name in BATCHED and self.changes):
            raise AttributeError(name)
        return getattr(self.bare, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in OWN:
            object.__setattr__(self, name, value)
        else:
            setattr(self.bare, name, value)

    @property
    def changes(self) -> bool:
        """Whether actions, observations or rewards are not those of the environment within."""
        return bool(self.layers) or self.flatten

    def _shaped(self, observation: Any) -> Any:
        return flat(observation) if self.flatten else observation


def bare(env: Any) -> Any:
    """Return the environment within a `TaskEnv`; another environment as it is."""
    return env.bare if isinstance(env, TaskEnv) else env


def flat_space(space: gymnasium.Space[Any]) -> spaces.Box:
    """Return the space of the vectors that observations are flattened to."""
    low, high = flat_bounds(space)
    return spaces.Box(low, high, dtype=np.float64)


def explored_actions(env: gymnasium.Env[Any, Any]) -> gymnasium.Space[Any]:
    """Return the space that actions are drawn from: that of `env`, and below a `ClipAction` what it clips to."""
    while isinstance(env, gymnasium.Wrapper) and (env._action_space is None or
                                                  isinstance(env, gymnasium.wrappers.ClipAction)):
        env = env.env
    return env.action_space
