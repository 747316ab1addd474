"""Success as part of the state, for environments that report it only when a step is made."""

from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.core.robot import Robot, missing_parts
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.resettable.actions import copied
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.bounds import widened
from pbcs_ompl.resettable.observations import flat_bounds
from pbcs_ompl.resettable.observing import missing_observe, observed_type, reset_options, state_observer
from pbcs_ompl.resettable.rules import Outcome, reported_success
from pbcs_ompl.resettable.sampling import uniform_in_ball
from pbcs_ompl.resettable.task_env import bare


class SuccessFlagEnv(gymnasium.Env[Array, Array]):
    """An environment with `get_env_state` and `set_env_state` but no `goal_distance`.

    Its state is [state of the environment N | success]. The last number is 1 where the step that led there was a
    success (see `rules.reported_success`). So success is a function of the state, in any process. States that no step
    has reached, as those of a reset or of a ball, are no successes.

    Args:
        inner: The environment without wrappers.
        offers: Its optional attributes.

    Raises:
        NotResettable: its bounds or observations are missing.
    """

    goal_threshold = 0.5

    def __init__(self, inner: Any, offers: EnvAttributes):
        self.inner, self._offers = inner, offers
        self.spec, self.render_mode = inner.spec, inner.render_mode
        self.action_space, self.observation_space = inner.action_space, inner.observation_space
        self._success = 0.0
        observe = state_observer(inner, offers)
        if observe is None:
            raise missing_observe(inner)
        self._observe = observe
        inner.reset(seed=0)
        state = as_vector(inner, inner.get_env_state())
        low, high = state_bounds(inner, offers, state)
        self.state_low, self.state_high = np.append(low, 0.0), np.append(high, 1.0)
        self.capabilities = offers.restores
        self.feature_dims = tuple(range(len(state))) if offers.feature_dims is None else offers.feature_dims
        # What the environment offers itself; `EnvAttributes` takes None for what is not offered.
        self.bin_size, self.max_episode_steps = offers.bin_size, offers.max_episode_steps
        self.feature_periods = offers.feature_periods
        self.parallel_batch, self.perturb_by_rollouts = offers.parallel_batch, offers.perturb_by_rollouts
        self.walls, self.goal_circle = offers.walls, offers.goal_circle
        robot = offers.robot
        self.robot = robot if robot is None or missing_parts(robot) else _FlaggedRobot(robot)
        self.advance_towards = None if offers.advance_towards is None else self._advance_towards

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Reset the environment."""
        self._success = 0.0
        observation, info = self.inner.reset(seed=seed, options=options)
        return observation, info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Make one step of the environment."""
        observation, reward, terminated, truncated, info = self.inner.step(copied(action))
        outcome = Outcome(self.inner, observation, float(reward), bool(terminated), info)
        self._success = float(reported_success(outcome))
        return observation, float(reward), bool(terminated), bool(truncated), info

    def get_env_state(self) -> Array:
        """Return the state [N + 1]."""
        return np.append(as_vector(self.inner, self.inner.get_env_state()), self._success)

    def set_env_state(self, state: Array) -> None:
        """Go back to a state [N + 1]."""
        self._success = float(state[-1])
        self.inner.set_env_state(np.array(state[:-1]))

    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] of states [B, N + 1]."""
        return self._observe(np.array(states, dtype=np.float64)[:, :-1])

    def goal_distance(self, states: Array) -> Array:
        """Return 0 for successes, 1 for other states [B]."""
        return 1.0 - np.asarray(states, dtype=np.float64)[:, -1]

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, N + 1] the environment calls valid [B]; within the bounds, where it says nothing.

        Whatever the flag: EST draws states near others until one is valid, and a drawn flag is never 0 or 1.
        """
        states = np.asarray(states, dtype=np.float64)
        flagged: BoolArray = (states[:, -1] >= 0.0) & (states[:, -1] <= 1.0)
        if self._offers.is_valid is not None and flagged.any():
            flagged[flagged] = self._offers.is_valid(states[flagged, :-1].copy())
        return flagged

    def distance(self, states: Array, others: Array) -> Array:
        """Return the distances [B] between states, whatever their success."""
        states, others = np.asarray(states)[:, :-1], np.asarray(others)[..., :-1]
        if self._offers.distance is not None:
            return self._offers.distance(states, others)
        lengths: Array = np.linalg.norm(states - others, axis=1)
        return lengths

    def perturb(self, state: Array, radius: float, count: int, rng: np.random.Generator) -> Array:
        """Draw states [count, N + 1] in the ball around a state, none of them a success."""
        draw = self._offers.perturb or uniform_in_ball
        return np.hstack([draw(state[:-1], radius, count, rng), np.zeros((count, 1))])

    def render(self) -> Any:
        """Render the environment."""
        return self.inner.render()

    def close(self) -> None:
        """Close the environment."""
        self.inner.close()

    def _advance_towards(self, states: Array, targets: Array) -> Array:
        assert self._offers.advance_towards is not None
        return self._offers.advance_towards(np.asarray(states)[:, :-1].copy(), targets)


class _FlaggedRobot:
    """A robot in states that end with the flag of success."""

    def __init__(self, robot: Robot):
        self._robot = robot
        self.place, self.symmetries, self.turning = robot.place, robot.symmetries, robot.turning
        self.heading, self.turned, self.fallen = robot.heading, robot.turned, robot.fallen

    def put(self, states: Array, places: Array, angles: Array) -> Array:
        """Return states [B, N + 1] with the robot moved and turned, none of them a success."""
        moved = self._robot.put(states[:, :-1], places, angles)
        return np.hstack([moved, np.zeros((len(moved), 1))])


def as_vector(env: Any, state: Any) -> Array:
    """Return what `get_env_state` returned as a new vector [N].

    Raises:
        NotResettable: it is none.
    """
    if not isinstance(state, np.ndarray | list | tuple) or np.ndim(state) != 1:
        raise NotResettable(f"{_name(env)}.get_env_state() returned a {type(state).__name__}; "
                            f"expected a vector of numbers")
    return np.array(state, dtype=np.float64)


def knows_bounds(env: Any, offers: EnvAttributes) -> bool:
    """Return whether an environment declares the bounds of its state, or observes all of it within finite bounds."""
    if offers.state_low is not None and offers.state_high is not None:
        return True
    low, high = flat_bounds(bare(env).observation_space)
    return bool(np.isfinite(high - low).all()) and observed_type(bare(env), reset_options(env)) is not None


def state_bounds(env: Any, offers: EnvAttributes, state: Array) -> tuple[Array, Array]:
    """Return the bounds of the state [N] that the environment declares, else those of its observations.

    Args:
        env: An environment that `knows_bounds`.
        offers: Its optional attributes.
        state: One of its states [N].

    Raises:
        NotResettable: they have another length.
    """
    if offers.state_low is not None and offers.state_high is not None:
        low, high = widened(offers.state_low, -np.inf), widened(offers.state_high, np.inf)
    else:
        low, high = flat_bounds(bare(env).observation_space)
    if low.shape != state.shape:
        raise NotResettable(f"{_name(env)}: state_low has {low.size} dimensions, the state has {len(state)}")
    return low, high


def _name(env: Any) -> str:
    return type(bare(env)).__name__
