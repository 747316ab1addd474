"""The adapter for environments with `get_env_state()`, `set_env_state(state)` and an ordinary `step`."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.errors import InvalidOption, InvalidState, NotResettable
from pbcs_ompl.core.types import Array, BoolArray, Capability, Transition
from pbcs_ompl.resettable.model import Model

Step = tuple[Array, float, bool, bool]
"""Next state [D], reward, terminated, and what the step itself said about success."""


def offers_get_set_state(env: gymnasium.Env[Any, Any]) -> bool:
    """Tell whether `env` has both methods."""
    return callable(getattr(env, "get_env_state", None)) and callable(getattr(env, "set_env_state", None))


class GetSetStateModel(Model):
    """Any environment that can save and restore its state as a vector; batches are loops over `step`.

    Beside the attributes that `Model` reads, the environment may offer:

    * `state_low`, `state_high`: it then promises to restore any valid vector within them. Without them the
      bounds of the observation space serve, if the state is the observation.
    * `observe(states)`: needed unless the state is the observation.
    * `is_valid(states)`: by default whatever is within the bounds.
    * `capabilities`, if they are not those that the bounds suggest.
    * `goal_distance(states)` and `goal_threshold`. Without them a success is what `info["is_success"]` or
      `info["success"]` says, else `terminated`; the distance to the goal is then 0 for the states in which a
      step of this model succeeded, and 1 for all others.

    Raises:
        NotResettable: the state is no vector, or bounds or observations are missing.
    """

    def __init__(self, env: Any):
        observation, _ = env.reset(seed=0)
        state = _as_vector(env, env.get_env_state())
        is_observation = np.shape(observation) == state.shape and bool(np.array_equal(state, observation))
        low, high, declared = _state_bounds(env, state, is_observation)
        super().__init__(env, low, high)
        if len(self.state_low) != len(state):
            raise NotResettable(f"{self.spec.id}: state_low has {len(self.state_low)} dimensions, "
                                  f"the state has {len(state)}")
        arbitrary: set[Capability] = {"arbitrary"} if declared else set()
        usual: frozenset[Capability] = frozenset({"visited", "exact", *arbitrary})
        self.capabilities: frozenset[Capability] = getattr(env, "capabilities", usual)
        self._observe: Callable[[Array], Array] | None = getattr(env, "observe", None)
        if self._observe is None and not is_observation:
            raise NotResettable(f"{self.spec.id}: the observation is not the state, so implement "
                                  f"`observe(states [B, D]) -> observations [B, O]`")
        self._goal_distance: Callable[[Array], Array] | None = getattr(env, "goal_distance", None)
        if self._goal_distance is not None and not hasattr(env, "goal_threshold"):
            raise NotResettable(f"{self.spec.id}: it has `goal_distance` but no `goal_threshold`; set both")
        self.goal_threshold = 0.5 if self._goal_distance is None else float(env.goal_threshold)
        self._is_valid: Callable[[Array], BoolArray] | None = getattr(env, "is_valid", None)
        self._reached: set[bytes] = set()

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, D] by one step under controls [B, A], one after the other.

        Raises:
            InvalidState: states of another shape, or not finite.
            InvalidOption: controls of another shape, or not finite.
        """
        states = _as_batch("states", states, len(self.state_low), InvalidState)
        controls = _as_batch("controls", controls, len(self.action_low), InvalidOption)
        if len(states) != len(controls):
            raise InvalidOption(f"got {len(controls)} controls for {len(states)} states")
        steps = self._steps(states, controls)
        after = np.array([step[0] for step in steps]).reshape(states.shape)
        rewards = np.array([step[1] for step in steps], dtype=np.float64)
        terminated = np.array([step[2] for step in steps], dtype=np.bool_)
        return Transition(after, rewards, terminated, self._successes(after, [step[3] for step in steps]))

    def step_one(self, state: list[float], control: list[float]) -> list[float]:
        """Return the next state of one state."""
        return self.transition(np.array([state]), np.array([control])).states[0].tolist()

    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] of states [B, D]."""
        return np.array(states, dtype=np.float64) if self._observe is None else self._observe(states)

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, D] to the goal; 0 or 1 where the environment has none."""
        states = np.asarray(states, dtype=np.float64)
        if self._goal_distance is not None:
            return np.asarray(self._goal_distance(states), dtype=np.float64)
        return np.array([0.0 if state.tobytes() in self._reached else 1.0 for state in states])

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are within the bounds and valid for the environment [B]."""
        valid = super().is_valid(states)
        if self._is_valid is not None and valid.any():
            valid[valid] = self._is_valid(np.asarray(states, dtype=np.float64)[valid])
        return valid

    def _steps(self, states: Array, controls: Array) -> list[Step]:
        return self._loop(self.env, states, controls)

    @staticmethod
    def _loop(env: Any, states: Array, controls: Array) -> list[Step]:
        """Step `env` from one state after the other."""
        steps, dtype = [], env.action_space.dtype
        for state, control in zip(states, controls, strict=True):
            env.set_env_state(state.copy())
            _, reward, terminated, _, info = env.step(control.astype(dtype))
            success = info.get("is_success", info.get("success", terminated))
            steps.append((_as_vector(env, env.get_env_state()), float(reward), bool(terminated), bool(success)))
        return steps

    def _successes(self, after: Array, flags: list[bool]) -> BoolArray:
        if self._goal_distance is None:
            self._reached.update(state.tobytes() for state, flag in zip(after, flags, strict=True) if flag)
        return self.goal_distance(after) < self.goal_threshold


def _as_vector(env: Any, state: Any) -> Array:
    if not isinstance(state, np.ndarray | list | tuple) or np.ndim(state) != 1:
        raise NotResettable(f"{type(env).__name__}.get_env_state() returned a {type(state).__name__}; "
                              f"expected a vector of numbers")
    return np.array(state, dtype=np.float64)


def _state_bounds(env: Any, state: Array, is_observation: bool) -> tuple[Array, Array, bool]:
    """Return the bounds of the state, and whether the environment declared them itself."""
    if hasattr(env, "state_low") and hasattr(env, "state_high"):
        return env.state_low, env.state_high, True
    box = env.observation_space
    if is_observation and np.isfinite(box.low).all() and np.isfinite(box.high).all():
        return box.low, box.high, False
    raise NotResettable(f"{type(env).__name__}: the bounds of its {len(state)} state dimensions are "
                          f"unknown; set `state_low` and `state_high`")


def _as_batch(name: str, values: Array, size: int, error: type[InvalidState] | type[InvalidOption]) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != size:
        raise error(f"{name}: expected an array of shape [B, {size}], got {list(array.shape)}")
    if not np.isfinite(array).all():
        raise error(f"{name}: not finite: {array[~np.isfinite(array).all(axis=1)][0].tolist()}")
    return array
