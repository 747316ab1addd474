"""A Gymnasium environment that does what a resettable model does, for the judge."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.types import Array


class ModelEnv(gymnasium.Env[Array, Array]):
    """Steps `model` from its initial state."""

    def __init__(self, model: Any):
        self.model = model
        self.action_space = Box(model.action_low, model.action_high, dtype=np.float64)
        self.observation_space = Box(model.state_low, model.state_high, dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        self.state = np.array(self.model.initial_state(seed))
        success = bool(self.model.goal_distance(self.state[None])[0] < self.model.goal_threshold)
        return self.state.copy(), {"is_success": success}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        outcome = self.model.transition(self.state[None], np.asarray(action)[None])
        self.state = outcome.states[0]
        return (self.state.copy(), float(outcome.rewards[0]), bool(outcome.terminated[0]), False,
                {"is_success": bool(outcome.success[0])})
