"""A point that moves in a square: what the mazes, the box and the disc have in common."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import isfinite, sqrt
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.batches import check_batch
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.types import Array, BoolArray, IndexArray, Transition
from pbcs_ompl.envs import point_kernels
from pbcs_ompl.envs.point_kernels import WholeStep
from pbcs_ompl.envs.point_robot import PointRobot
from pbcs_ompl.envs.rendering import rasterise

MAX_STEP = 0.1
GOAL_RADIUS = 0.2
BIN_SIZE = 0.15
"""Ex solves mazes of size 2 to 15 with about 5 % fewer transitions than with 0.1, 0.2 or 0.25 (260 mazes)."""

CompiledStep = tuple[Any, Array, Array, IndexArray]
"""A function with the signature `core.step_kernels.STEP_SIGNATURE`, its settings, table and integers."""


class PointEnv(gymnasium.Env[Array, Array], ABC):
    """S = [0, extent]^2, A = [-0.1, 0.1]^2, reward 1 where ||s' - goal|| < 0.2 ([Matheron2020] 3.1, 5.4).

    The state is the observation: the position. Offers the `VectorisedEnv` protocol. Actions outside of the
    box are clipped. A subclass says how points move (`move`, `move_one`) and where they can be (`is_valid`).

    Args:
        extent: Edge length of the world.
        start: Where `reset` puts the point.
        goal: Centre of the goal, or None for an environment without one: it never ends and rewards nothing.
        wall_penalty: Added to the reward of a step that hits a wall; 0 or negative.
        terminate_on_success: End the episode in the goal. Differs: the thesis has no terminal states (False).
        normalize_actions: Take actions in [-1, 1]^2, scaled by 0.1.
        max_episode_steps: Suggested length of an episode (no limit of this class).
        own_settings: What the kernels of the subclass find in `settings` from `point_kernels.FIRST_FREE` on.
        render_mode: One of `metadata["render_modes"]`, or None.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 30}  # type: ignore[misc]
    feature_dims = (0, 1)
    robot = PointRobot()
    goal_threshold = GOAL_RADIUS

    def __init__(self, extent: float, start: Sequence[float], goal: Sequence[float] | None, *,
                 wall_penalty: float = 0.0, terminate_on_success: bool = True,
                 normalize_actions: bool = False, max_episode_steps: int = 1000,
                 own_settings: Sequence[float] = (), render_mode: str | None = None):
        modes = self.metadata["render_modes"]
        if render_mode not in (None, *modes):
            raise InvalidOption(f"render_mode={render_mode!r}: expected one of {modes}")
        if not (np.isfinite(wall_penalty) and wall_penalty <= 0):
            raise InvalidOption(f"wall_penalty={wall_penalty!r}: expected 0 or a negative number, such as -1")
        self.render_mode = render_mode
        self.max_episode_steps = max_episode_steps
        self.state_low = np.zeros(2)
        self.state_high = np.full(2, float(extent))
        self.bin_size = np.full(2, BIN_SIZE)
        limit = 1.0 if normalize_actions else MAX_STEP
        self.action_space = Box(-limit, limit, (2,), np.float64)
        self.observation_space = Box(self.state_low, self.state_high, dtype=np.float64)
        self.settings = np.array([0.0] * point_kernels.FIRST_FREE + [float(value) for value in own_settings])
        self.settings[point_kernels.LIMIT] = limit
        self.settings[point_kernels.SCALE] = MAX_STEP / limit
        self.settings[point_kernels.GOAL_RADIUS] = GOAL_RADIUS
        self.settings[point_kernels.PENALTY] = wall_penalty
        self.settings[point_kernels.TERMINATE] = terminate_on_success
        self.start = self._checked("start", start)
        self.goal = None if goal is None else self._checked("goal", goal)
        self.goal_circle = None if self.goal is None else (*self.goal.tolist(), GOAL_RADIUS)
        goal_x, goal_y = (np.inf, np.inf) if self.goal is None else self.goal
        self.settings[point_kernels.GOAL_X], self.settings[point_kernels.GOAL_Y] = goal_x, goal_y
        self._position: tuple[float, float] = (self.start[0].item(), self.start[1].item())

    @abstractmethod
    def move(self, states: Array, controls: Array) -> tuple[Array, BoolArray]:
        """Return the next states [B, 2] and whether a wall was hit [B]; the arguments are trusted."""

    @abstractmethod
    def move_one(self, x: float, y: float, a: float, b: float) -> WholeStep:
        """Return what `move` does, bit for bit, with one point (x, y) under the control (a, b).

        Returns:
            The next x and y, whether a wall was hit, the reward, whether the episode ends, the distance to the goal.
        """

    @abstractmethod
    def compiled_step(self) -> CompiledStep | None:
        """Return the step as a function for compiled planners, or None; see `core.step_kernels.STEP_SIGNATURE`."""

    @abstractmethod
    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, 2] the point can be in [B]."""

    def in_bounds(self, states: Array) -> BoolArray:
        """Return which states [B, 2] lie in [0, extent]^2 [B]."""
        inside = (np.asarray(states) >= self.state_low) & (np.asarray(states) <= self.state_high)
        both: BoolArray = np.logical_and.reduce(inside, axis=1)
        return both

    @property
    def walls(self) -> Array:
        """Rectangles [W, 4] for pictures."""
        return np.empty((0, 4))

    def reset(self, *, seed: int | None = None,
              options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Put the point at the start, or at `options["state"]`.

        Raises:
            InvalidState: the given state is in a wall, outside, or not finite.
            InvalidOption: an option other than "state".
        """
        super().reset(seed=seed)
        unknown = set(options or {}) - {"state"}
        if unknown:
            raise InvalidOption(f"reset options {sorted(unknown)}: the only option is 'state'")
        self.set_env_state((options or {}).get("state", self.start))
        x, y = self._position
        dx, dy = x - self.settings[point_kernels.GOAL_X].item(), y - self.settings[point_kernels.GOAL_Y].item()
        return self.get_env_state(), _info(False, sqrt(dx * dx + dy * dy))

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Move by `action` [2]; `info` has `is_success` = `success`, `hit_wall`, `distance_to_goal`."""
        control = np.asarray(action, dtype=np.float64).ravel().tolist()
        if len(control) != 2 or not (isfinite(control[0]) and isfinite(control[1])):
            check_batch("action", np.reshape(action, (1, -1)), 2, InvalidOption)  # raises, and says why
        x, y = self._position
        x, y, hit, reward, terminated, distance = self.move_one(x, y, control[0], control[1])
        self._position = x, y
        observation = np.empty(2)
        observation[0], observation[1] = x, y
        return observation, reward, terminated, False, _info(hit, distance)

    def step_one(self, state: list[float], control: list[float]) -> list[float]:
        """Return the next state, bit-equal to `transition`. Nothing is checked; NaN gives NaN."""
        return list(self.move_one(*state, *control)[:2])

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, 2] by one step under controls [B, 2].

        Raises:
            InvalidState: states of another shape, or not finite.
            InvalidOption: controls of another shape, or not finite.
        """
        states = check_batch("states", states, 2, InvalidState)
        controls = check_batch("controls", controls, 2, InvalidOption)
        if len(states) != len(controls):
            raise InvalidOption(f"got {len(controls)} controls for {len(states)} states")
        after, hits = self.move(states, controls)
        return Transition(after, *point_kernels.finish(self.settings, after, hits))

    def displacements(self, controls: Array) -> Array:
        """Return how far controls [B, 2] move the point [B, 2], as the kernels compute it."""
        limit = self.settings[point_kernels.LIMIT]
        moved: Array = np.clip(controls, -limit, limit) * self.settings[point_kernels.SCALE]
        return moved

    def get_env_state(self) -> Array:
        """Return the position [2]."""
        return np.array(self._position)

    def set_env_state(self, state: Array) -> None:
        """Put the point at `state` [2].

        Raises:
            InvalidState: the state is in a wall, outside, or not finite.
        """
        x, y = self._checked("state", state).tolist()
        self._position = x, y

    def observe(self, states: Array) -> Array:
        """Return the observations [B, 2] of states [B, 2]: the positions."""
        return np.array(states, dtype=np.float64)

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, 2] to the centre of the goal; infinite without a goal."""
        return point_kernels.goal_distance(self.settings, np.ascontiguousarray(states, dtype=np.float64))

    def advance_towards(self, states: Array, targets: Array) -> Array:
        """Return the controls [B, 2] from states [B, 2] straight to targets [B, 2], clipped to the box."""
        limit = self.settings[point_kernels.LIMIT]
        controls: Array = np.clip((np.asarray(targets) - states) / self.settings[point_kernels.SCALE], -limit, limit)
        return controls

    def render(self) -> Any:
        """Return the picture as an array [height, width, 3] of uint8, for "rgb_array"."""
        if self.render_mode is None:
            return None
        return rasterise(float(self.state_high[0]), self.walls, self.goal_circle, self.get_env_state())

    def _checked(self, name: str, point: Sequence[float] | Array) -> Array:
        try:
            state = np.array(point, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidState(f"{name}={point!r}: expected two numbers") from error
        if state.shape != (2,) or not np.isfinite(state).all():
            raise InvalidState(f"{name}={state.tolist()}: expected two finite numbers")
        if not self.in_bounds(state[None])[0]:
            raise InvalidState(f"{name}={state.tolist()} is outside of [0, {self.state_high[0]:g}]^2")
        if not self.is_valid(state[None])[0]:
            raise InvalidState(f"{name}={state.tolist()} is {self.where_invalid}; choose another point")
        return state

    where_invalid = "inside a wall"


def _info(hit_wall: bool, distance: float) -> dict[str, Any]:
    success = distance < GOAL_RADIUS
    return {"is_success": success, "success": success, "hit_wall": hit_wall, "distance_to_goal": distance}
