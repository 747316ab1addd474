"""A rectangle that moves and turns among walls: what the car and the planar quadrotor have in common."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.batches import check_batch
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.step_kernels import address_of, step_batch
from pbcs_ompl.core.types import Array, BoolArray, Transition
from pbcs_ompl.envs.oriented_kernels import MARGIN
from pbcs_ompl.envs.point_env import CompiledStep
from pbcs_ompl.envs.rendering import OrientedBox, rasterise
from pbcs_ompl.envs.walls_fcl import WallsFcl

ANGLE = 2
"""The place of the angle in the state, after (x, y)."""
NO_INTEGERS = np.zeros(1, dtype=np.int64)
BORDER = 0.1
"""How thick the walls around the world are."""


class BodyEnv(gymnasium.Env[Array, Array], ABC):
    """A body in [0, extent]^2 under two controls in [-1, 1]; reward 1 in the goal. Offers the `VectorisedEnv` protocol.

    The state is (x, y, angle, speeds...), the angle in [-pi, pi); the observation is the state, then the cosine and the
    sine of the angle. A `goal_distance` is in tolerances, so that the threshold is 1. Controls outside of the box are
    clipped. Nothing is random. A subclass says how bodies move (`kernel`, a compiled step). `walls` are the obstacles
    and the border of the world, for pictures and lines; steps know the border without.

    Args:
        settings: What the kernels take.
        extent: Edge length of the world.
        obstacles: Rectangles (x0, y0, x1, y1).
        speeds: Lower and upper bounds of the speeds [D - 3, 2].
        half_edges: Half of the edges of the body, along its angle and across.
        ahead: How far the centre of the body is ahead of (x, y).
        start: Where `reset` puts the body: (x, y, angle), at rest.
        goal: Centre and radius of the goal (x, y, r), for pictures.
        max_episode_steps: Suggested length of an episode (no limit of this class).
        render_mode: "rgb_array" or None.

    Raises:
        InvalidOption: obstacles that are no rectangles in the world.
        InvalidState: a start or goal that touches a wall, or is outside.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 20}  # type: ignore[misc]
    goal_threshold = 1.0
    kernel: ClassVar[Callable[..., Any]]

    def __init__(self, settings: Sequence[float], *, extent: float, obstacles: Sequence[Sequence[float]],
                 speeds: Sequence[tuple[float, float]], half_edges: tuple[float, float], start: Sequence[float],
                 goal: tuple[float, float, float], max_episode_steps: int, ahead: float = 0.0,
                 render_mode: str | None = None):
        if render_mode not in (None, "rgb_array"):
            raise InvalidOption(f"render_mode={render_mode!r}: expected 'rgb_array' or None")
        self.render_mode, self.max_episode_steps = render_mode, max_episode_steps
        self.settings, self.half_edges, self.ahead = np.array(settings, dtype=np.float64), half_edges, ahead
        self.obstacles = _checked_obstacles(obstacles, extent)
        self.walls = np.concatenate([self.obstacles, _border(extent)])
        self._fcl = WallsFcl(self.obstacles)
        low, high = np.array(speeds, dtype=np.float64).T
        self.state_low = np.concatenate([[0.0, 0.0, -np.pi], low])
        self.state_high = np.concatenate([[extent, extent, np.pi], high])
        self.goal_circle = goal
        self.action_space = Box(-1.0, 1.0, (2,), np.float64)
        self.observation_space = Box(np.concatenate([self.state_low, [-1.0, -1.0]]),
                                     np.concatenate([self.state_high, [1.0, 1.0]]), dtype=np.float64)
        self._start = self._checked("start", np.concatenate([start, np.zeros(len(low))]))
        self._state = self._start.copy()

    @abstractmethod
    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, D] to the goal, in tolerances."""

    def compiled_step(self) -> CompiledStep:
        """Return the step as a function for compiled planners; see `core.step_kernels.STEP_SIGNATURE`."""
        return type(self).kernel, self.settings, self.obstacles, NO_INTEGERS

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are within the bounds and, by FCL, touch no wall [B]."""
        states = np.asarray(states, dtype=np.float64)
        valid: BoolArray = np.logical_and.reduce((states >= self.state_low) & (states <= self.state_high), axis=1)
        valid[valid] = ~self._fcl.overlaps(self.poses(states[valid]), self.half_edges)
        poses, (along, across) = self.poses(states), self.half_edges
        cosine, sine = np.abs(np.cos(poses[:, 2])), np.abs(np.sin(poses[:, 2]))
        reach = np.stack([along * cosine + across * sine, along * sine + across * cosine], axis=1)
        inside = (poses[:, :2] >= reach) & (poses[:, :2] <= self.state_high[:2] - reach)
        valid &= inside.all(axis=1)
        return valid

    def poses(self, states: Array) -> Array:
        """Return the centres and angles [B, 3] of the bodies in states [B, D]."""
        x, y, angle = np.asarray(states, dtype=np.float64)[:, :3].T
        return np.stack([x + self.ahead * np.cos(angle), y + self.ahead * np.sin(angle), angle], axis=1)

    def reset(self, *, seed: int | None = None,
              options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Put the body at the start, at rest, or into `options["state"]`.

        Raises:
            InvalidState: the given state touches a wall, is outside, or not finite.
            InvalidOption: an option other than "state".
        """
        super().reset(seed=seed)
        unknown = set(options or {}) - {"state"}
        if unknown:
            raise InvalidOption(f"reset options {sorted(unknown)}: the only option is 'state'")
        self._state = self._checked("state", (options or {}).get("state", self._start))
        return self._observation(), self._info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Make one step; `info` has `is_success` = `success` and `distance_to_goal`, in tolerances."""
        outcome = self.transition(self._state[None], np.reshape(action, (1, -1)))
        self._state = outcome.states[0]
        return self._observation(), float(outcome.rewards[0]), bool(outcome.terminated[0]), False, self._info()

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, D] by one step under controls [B, 2].

        Raises:
            InvalidState: states of another shape, or not finite.
            InvalidOption: controls of another shape, or not finite.
        """
        states = check_batch("states", states, len(self.state_low), InvalidState)
        controls = check_batch("controls", controls, 2, InvalidOption)
        if len(states) != len(controls):
            raise InvalidOption(f"got {len(controls)} controls for {len(states)} states")
        address = address_of(type(self).kernel)
        return Transition(*step_batch(address, self.settings, self.obstacles, NO_INTEGERS, states, controls))

    def get_env_state(self) -> Array:
        """Return the state [D]."""
        return self._state.copy()

    def set_env_state(self, state: Array) -> None:
        """Put the body into a state [D].

        Raises:
            InvalidState: it touches a wall, is outside, or not finite.
        """
        self._state = self._checked("state", state)

    def observe(self, states: Array) -> Array:
        """Return the observations [B, D + 2] of states [B, D]."""
        states = np.array(states, dtype=np.float64)
        angles = states[:, ANGLE:ANGLE + 1]
        observations: Array = np.concatenate([states, np.cos(angles), np.sin(angles)], axis=1)
        return observations

    def distance(self, states: Array, others: Array) -> Array:
        """Return the Euclidean distances [B] between states [B, D] and others, angles the short way round."""
        difference = np.asarray(states, dtype=np.float64) - others
        difference[:, ANGLE] = np.mod(difference[:, ANGLE] + np.pi, 2 * np.pi) - np.pi
        lengths: Array = np.linalg.norm(difference, axis=1)
        return lengths

    def render(self) -> Any:
        """Return the picture as an array [480, 480, 3] of uint8, for "rgb_array"."""
        if self.render_mode is None:
            return None
        x, y, angle = self.poses(self._state[None])[0]
        return rasterise(float(self.state_high[0]), self.obstacles, self.goal_circle,
                         OrientedBox(x, y, angle, *self.half_edges))

    def _observation(self) -> Array:
        observation: Array = self.observe(self._state[None])[0]
        return observation

    def _info(self) -> dict[str, Any]:
        distance = float(self.goal_distance(self._state[None])[0])
        success = distance < self.goal_threshold
        return {"is_success": success, "success": success, "distance_to_goal": distance}

    def _checked(self, name: str, values: Any) -> Array:
        state = check_batch(name, np.reshape(values, (1, -1)), len(self.state_low), InvalidState)
        if not self.is_valid(state)[0]:
            raise InvalidState(f"{name}={state[0].tolist()} touches a wall, or is outside of "
                               f"{self.state_low.tolist()} to {self.state_high.tolist()}; choose another")
        checked: Array = state[0].copy()
        return checked


def _checked_obstacles(obstacles: Sequence[Sequence[float]], extent: float) -> Array:
    try:
        walls = np.array(obstacles, dtype=np.float64).reshape(-1, 4)
    except (TypeError, ValueError) as error:
        raise InvalidOption(f"obstacles={obstacles!r}: expected rectangles (x0, y0, x1, y1)") from error
    inside = np.isfinite(walls).all() and (walls >= 0.0).all() and (walls <= extent).all()
    if not inside or not (walls[:, :2] + MARGIN < walls[:, 2:]).all():
        raise InvalidOption(f"obstacles={walls.tolist()}: expected rectangles (x0, y0, x1, y1) within "
                            f"[0, {extent:g}]^2, x0 < x1 and y0 < y1")
    return walls


def _border(extent: float) -> Array:
    """Return the rectangles [4, 4] around a world [0, extent]^2."""
    low, high = -BORDER, extent + BORDER
    return np.array([(low, low, high, 0.0), (low, extent, high, high), (low, 0.0, 0.0, extent),
                     (extent, 0.0, high, extent)])
