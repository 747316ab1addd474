"""The adapter for environments with `get_env_state()`, `set_env_state(state)` and an ordinary `step`."""

from collections.abc import Callable
from typing import Any

import numpy as np

from pbcs_ompl.core.batches import check_batch
from pbcs_ompl.core.errors import InvalidOption, InvalidState, NotResettable
from pbcs_ompl.core.types import Array, BoolArray, Transition
from pbcs_ompl.resettable.actions import Actions
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.success_flag import as_vector, state_bounds
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.model import Model
from pbcs_ompl.resettable.observing import missing_observe, state_observer

Step = tuple[Array, float, bool, bool, Any]
"""Next state [D], reward, terminated, truncated, observation."""


class GetSetStateModel(Model):
    """An environment that saves and restores its state as a vector; batches are loops over `step`.

    It has `goal_distance(states)` and `goal_threshold`; `adapt` puts a `SuccessFlagEnv` around one that has not.

    Raises:
        NotResettable: the state is no vector, or bounds or observations are missing.
    """

    def __init__(self, env: Any):
        offers = EnvAttributes.of(env)
        env.reset(seed=0)
        state = as_vector(env, env.get_env_state())
        super().__init__(env, offers, *state_bounds(env, offers, state))
        self.capabilities = offers.restores
        observe = state_observer(env, offers)
        if observe is None:
            raise missing_observe(env)
        self._observe = observe
        self._seen: dict[bytes, Any] = {}
        if offers.goal_distance is None or offers.goal_threshold is None:
            raise NotResettable(f"{self.spec.id}: `goal_distance` and `goal_threshold` go together; set both")
        self._goal_distance: Callable[[Array], Array] = offers.goal_distance
        self.goal_threshold = float(offers.goal_threshold)

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, D] by one step under controls [B, A], one after the other.

        Raises:
            InvalidState: states of another shape, or not finite.
            InvalidOption: controls of another shape, or not finite.
        """
        states = check_batch("states", states, len(self.state_low), InvalidState)
        controls = check_batch("controls", controls, len(self.action_low), InvalidOption)
        if len(states) != len(controls):
            raise InvalidOption(f"got {len(controls)} controls for {len(states)} states")
        steps = self._steps(states, controls)
        after = np.array([step[0] for step in steps]).reshape(states.shape)
        if isinstance(self.env, RestorableEnv):  # whose restored states show exactly this, as the branching test checks
            self._seen = {state.tobytes(): step[4] for state, step in zip(after, steps, strict=True)}
        rewards = np.array([step[1] for step in steps], dtype=np.float64)
        terminated = np.array([step[2] for step in steps], dtype=np.bool_)
        truncated = np.array([step[3] for step in steps], dtype=np.bool_)
        return Transition(after, rewards, terminated, self.goal_distance(after) < self.goal_threshold, truncated)

    def step_one(self, state: list[float], control: list[float]) -> list[float]:
        """Return the next state of one state; empty where the episode ends there and is no success."""
        outcome = self.transition(np.array([state]), np.array([control]))
        if outcome.ended[0] and not outcome.success[0]:
            return []
        following: list[float] = outcome.states[0].tolist()
        return following

    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] of states [B, D]; the last steps have shown those of where they led."""
        states = np.array(states, dtype=np.float64)
        rows = [self._seen.get(state.tobytes()) for state in states] if self._seen else []
        if not rows or all(row is None for row in rows):
            return self._observe(states)
        missing = [index for index, row in enumerate(rows) if row is None]
        if missing:
            for index, row in zip(missing, self._observe(states[missing]), strict=True):
                rows[index] = row
        return np.array(rows)

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, D] to the goal."""
        return np.asarray(self._goal_distance(np.array(states, dtype=np.float64)), dtype=np.float64)

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are within the bounds and valid for the environment [B]."""
        valid = super().is_valid(states)
        if self._offers.is_valid is not None and valid.any():
            valid[valid] = self._offers.is_valid(np.asarray(states, dtype=np.float64)[valid])
        return valid

    def _steps(self, states: Array, controls: Array) -> list[Step]:
        return self._loop(self.env, states, self.actions.to_actions(controls))

    @staticmethod
    def _loop(env: Any, states: Array, actions: Actions) -> list[Step]:
        """Step `env` from one state after the other."""
        steps = []
        for state, action in zip(states, actions, strict=True):
            env.set_env_state(state.copy())
            observation, reward, terminated, truncated, _ = env.step(action)
            steps.append((as_vector(env, env.get_env_state()), float(reward), bool(terminated), bool(truncated),
                          observation))
        return steps
