"""A point that moves on a line: 1D-Toy and Drift, `pbcs/Toy1D-v0` and `pbcs/Drift-v0`."""

from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.batches import check_batch
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.types import Array, BoolArray, Transition

MAX_STEP = 0.1
HIGH = 1.0
EPISODE_STEPS = 50


class LineEnv(gymnasium.Env[Array, Array]):
    """S = [low, 1], A = [-0.1, 0.1], s' = s + a, cut off at the ends; every episode starts at 0.

    The state is the observation. Offers the `VectorisedEnv` protocol. Actions outside of the box are clipped.
    A step that ends below 0 succeeds: reward 1, and the episode ends. With `low` = 0 there is no such step.

    Args:
        low: The lowest state: -0.1 with a goal, 0 without one.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}  # type: ignore[misc]
    feature_dims = (0,)
    goal_threshold = MAX_STEP
    max_episode_steps = EPISODE_STEPS

    def __init__(self, low: float):
        self.state_low, self.state_high = np.array([low]), np.array([HIGH])
        self.bin_size = np.array([MAX_STEP / 2.0])
        self.action_space = Box(-MAX_STEP, MAX_STEP, (1,), np.float64)
        self.observation_space = Box(self.state_low, self.state_high, dtype=np.float64)
        self._state = np.zeros(1)

    def reset(self, *, seed: int | None = None,
              options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Put the point at 0, or at `options["state"]`.

        Raises:
            InvalidState: the given state is outside, or not finite.
            InvalidOption: an option other than "state".
        """
        super().reset(seed=seed)
        unknown = set(options or {}) - {"state"}
        if unknown:
            raise InvalidOption(f"reset options {sorted(unknown)}: the only option is 'state'")
        self.set_env_state((options or {}).get("state", np.zeros(1)))
        return self._state.copy(), {"is_success": False, "success": False}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Move by `action` [1]; `info` has `is_success` = `success`."""
        outcome = self.transition(self._state[None], np.reshape(action, (1, -1)))
        self._state = outcome.states[0]
        success = bool(outcome.success[0])
        info = {"is_success": success, "success": success}
        return self._state.copy(), float(outcome.rewards[0]), bool(outcome.terminated[0]), False, info

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, 1] by one step under controls [B, 1].

        Raises:
            InvalidState: states of another shape, or not finite.
            InvalidOption: controls of another shape, or not finite.
        """
        states = check_batch("states", states, 1, InvalidState)
        controls = check_batch("controls", controls, 1, InvalidOption)
        if len(states) != len(controls):
            raise InvalidOption(f"got {len(controls)} controls for {len(states)} states")
        after = np.clip(states + np.clip(controls, -MAX_STEP, MAX_STEP), self.state_low, HIGH)
        success = after[:, 0] < 0.0
        return Transition(after, success.astype(np.float64), success, success.copy())

    def get_env_state(self) -> Array:
        """Return the position [1]."""
        return self._state.copy()

    def set_env_state(self, state: Array) -> None:
        """Put the point at `state` [1].

        Raises:
            InvalidState: the state is outside, or not finite.
        """
        checked = check_batch("state", np.reshape(state, (1, -1)), 1, InvalidState)
        if not self.is_valid(checked)[0]:
            raise InvalidState(f"state={checked[0].tolist()} is outside of [{self.state_low[0]:g}, {HIGH:g}]")
        self._state = checked[0].copy()

    def observe(self, states: Array) -> Array:
        """Return the observations [B, 1] of states [B, 1]: the positions."""
        return np.array(states, dtype=np.float64)

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, 1] to -0.1, the lowest state a step leads to; 0 in the goal."""
        position = np.asarray(states, dtype=np.float64)[:, 0]
        return np.where(position < 0.0, 0.0, position + MAX_STEP)

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, 1] lie on the line [B]."""
        position = np.asarray(states)[:, 0]
        inside: BoolArray = (position >= self.state_low[0]) & (position <= HIGH)
        return inside

    def advance_towards(self, states: Array, targets: Array) -> Array:
        """Return the controls [B, 1] from states [B, 1] straight to targets [B, 1], clipped to the box."""
        return np.clip(np.asarray(targets) - states, -MAX_STEP, MAX_STEP)


class Toy1DEnv(LineEnv):
    """S = [0, 1], A = [-0.1, 0.1], start 0; reward 1 and the end of the episode when s + a < 0.

    Source: [Matheron2020] 6.2.1, Fig. 6.1. Differs: there a rewarded step leads to the state 0, the start; here it
    leads to s + a, so that success is a function of the state. No agent learns from what follows a terminal
    transition.
    """

    def __init__(self) -> None:
        super().__init__(low=-MAX_STEP)


class DriftEnv(LineEnv):
    """S = [0, 1], A = [-0.1, 0.1], start 0; no transition is rewarded or terminal.

    Source: [Matheron2020] 6.3.1. Differs: none.
    """

    def __init__(self) -> None:
        super().__init__(low=0.0)

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, 1] to the goal: infinite, there is none."""
        return np.full(len(states), np.inf)
