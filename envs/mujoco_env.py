"""MuJoCo simulations as functions of batches of states: what the ant and the cheetah have in common."""

import os
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.batches import check_batch
from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.rendering import check_can_render, prefer_headless_rendering
from pbcs_ompl.core.types import Array, BoolArray, Transition

prefer_headless_rendering()  # before MuJoCo is imported

import mujoco  # noqa: E402
from mujoco.rollout import Rollout  # noqa: E402

PHYSICS = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
SMALL_BATCH = 2
"""A smaller batch is stepped without waking the threads."""
FAR, FAST, LONG = 1e3, 1e4, 1e6
"""Bounds of lengths (m), speeds (m/s) and times (s) that no simulation reaches: OMPL wants finite ones."""


class BatchedMujocoEnv(gymnasium.Env[Array, Array], ABC):
    """A MuJoCo model whose state is [time | qpos | qvel]; offers the `VectorisedEnv` protocol.

    A control is held for `frame_skip` steps of the simulator. The solver starts cold in the first of them, so that
    the next state is a function of the state alone, and `mujoco.rollout` computes it on all cores, bit for bit as
    one after the other. Differs from Gymnasium, which starts warm: by rounding errors.

    Args:
        model: The simulator's model, without activations.
        frame_skip: Steps of the simulator in one step of the environment.
        reset_noise: `reset` adds uniform noise in [-x, x] to positions and normal noise times x to speeds.
        threads: Threads for batches; None for one on each core.
        render_mode: "rgb_array" or None.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 20}  # type: ignore[misc]
    perturb_by_rollouts = True
    parallel_batch = 8
    """Whole rounds for 2, 4 and 8 threads, and enough of them to hide that some states take longer."""
    goal_threshold: float
    walls: Array = np.empty((0, 4))
    goal_circle: tuple[float, float, float] | None = None
    camera: str | None = None

    def __init__(self, model: Any, *, frame_skip: int, reset_noise: float, threads: int | None = None,
                 render_mode: str | None = None):
        if render_mode not in (None, "rgb_array"):
            raise InvalidOption(f"render_mode={render_mode!r}: expected 'rgb_array' or None")
        if not (np.isfinite(reset_noise) and reset_noise >= 0):
            raise InvalidOption(f"reset_noise={reset_noise!r}: expected a finite number >= 0")
        if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
            raise InvalidOption(f"threads={threads!r}: expected an integer above 0, or None for all cores")
        self.model, self.data = model, mujoco.MjData(model)
        self.render_mode, self.reset_noise, self.frame_skip = render_mode, float(reset_noise), frame_skip
        self._threads = len(os.sched_getaffinity(0)) if threads is None else threads
        self._pool: tuple[Any, list[Any]] | None = None
        self._renderer: Any = None
        low, high = model.actuator_ctrlrange.T
        self.action_space = Box(low, high, dtype=np.float64)
        speeds = np.full(model.nv, FAST)
        self.state_high = np.concatenate([[LONG], np.full(model.nq, FAR), speeds])
        self.state_low = np.concatenate([[0.0], np.full(model.nq, -FAR), -speeds])
        self._nq = int(model.nq)

    @property
    def step_seconds(self) -> float:
        """Simulated seconds of one step."""
        return float(self.frame_skip * self.model.opt.timestep)

    @abstractmethod
    def outcome(self, before: Array, after: Array) -> tuple[Array, BoolArray, BoolArray]:
        """Return rewards, terminated and success [B] of the transitions from `before` to `after` [B, D]."""

    @abstractmethod
    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] of states [B, D]."""

    @abstractmethod
    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, D] to the goal."""

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are within the bounds [B]."""
        states = np.asarray(states)
        inside: BoolArray = np.logical_and.reduce((states >= self.state_low) & (states <= self.state_high), axis=1)
        return inside

    def distance(self, states: Array, others: Array) -> Array:
        """Return the lengths [B] of MuJoCo's differences of positions, in which turns of a free joint are angles."""
        states, others = np.asarray(states, dtype=np.float64), np.broadcast_to(others, np.shape(states))
        rows = np.empty((len(states), self.model.nv))
        positions = slice(1, 1 + self._nq)
        for row, state, other in zip(rows, states, others, strict=True):
            mujoco.mj_differentiatePos(self.model, row, 1.0, other[positions].copy(), state[positions].copy())
        lengths: Array = np.linalg.norm(rows, axis=1)
        return lengths

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin at the model's initial position with noise, or at `options["state"]`.

        Raises:
            InvalidState: the given state is not valid.
            InvalidOption: an option other than "state".
        """
        super().reset(seed=seed)
        unknown = set(options or {}) - {"state"}
        if unknown:
            raise InvalidOption(f"reset options {sorted(unknown)}: the only option is 'state'")
        mujoco.mj_resetData(self.model, self.data)
        noise = self.reset_noise
        self.data.qpos[:] += self.np_random.uniform(-noise, noise, self.model.nq)
        self.data.qvel[:] += noise * self.np_random.standard_normal(self.model.nv)
        if options:
            self.set_env_state(options["state"])
        mujoco.mj_forward(self.model, self.data)
        state = self.get_env_state()[None]
        success = bool(self.goal_distance(state)[0] < self.goal_threshold)
        return self.observe(state)[0], self._info(state, success=success)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Make one step; `info` has `is_success` = `success` and `distance_to_goal`."""
        before = self.get_env_state()[None]
        after = self._advance(before, check_batch("action", np.reshape(action, (1, -1)), self.model.nu, InvalidOption))
        rewards, terminated, success = self.outcome(before, after)
        info = self._info(after, success=bool(success[0]))
        return self.observe(after)[0], float(rewards[0]), bool(terminated[0]), False, info

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, D] by one step under controls [B, A], on all cores.

        Raises:
            InvalidState: states of another shape, or not finite.
            InvalidOption: controls of another shape, or not finite.
        """
        states = check_batch("states", states, len(self.state_low), InvalidState)
        controls = check_batch("controls", controls, self.model.nu, InvalidOption)
        if len(states) != len(controls):
            raise InvalidOption(f"got {len(controls)} controls for {len(states)} states")
        if len(states) < SMALL_BATCH or self._threads < 2:
            after = self._advance(states, controls)
        else:
            after = self._roll_out(states, controls)
        return Transition(after, *self.outcome(states, after))

    def get_env_state(self) -> Array:
        """Return [time | qpos | qvel]."""
        state = np.empty(len(self.state_low))
        mujoco.mj_getState(self.model, self.data, state, PHYSICS)
        return state

    def set_env_state(self, state: Array) -> None:
        """Go to a state [D].

        Raises:
            InvalidState: it is of another size, or not finite.
        """
        vector = check_batch("state", np.reshape(state, (1, -1)), len(self.state_low), InvalidState)
        mujoco.mj_setState(self.model, self.data, vector[0], PHYSICS)

    def render(self) -> Any:
        """Return an image [480, 480, 3].

        Raises:
            MissingDependency: nothing can render here.
        """
        if self.render_mode is None:
            return None
        if self._renderer is None:
            check_can_render()
            self._renderer = mujoco.Renderer(self.model, 480, 480)
        mujoco.mj_forward(self.model, self.data)
        self._renderer.update_scene(self.data, -1 if self.camera is None else self.camera)
        return self._renderer.render()

    def close(self) -> None:
        """Let go of threads and of the renderer."""
        if self._pool is not None:
            self._pool[0].close()
        if self._renderer is not None:
            self._renderer.close()
        self._pool = self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy needs: threads and renderer are made again when they are needed."""
        return {**self.__dict__, "_pool": None, "_renderer": None}

    def _advance(self, states: Array, controls: Array) -> Array:
        """Step one state after the other."""
        model, data = self.model, self.data
        after = np.empty_like(states)
        for row, state, control in zip(after, states, controls, strict=True):
            mujoco.mj_setState(model, data, state, PHYSICS)
            data.qacc_warmstart[:] = 0.0
            data.ctrl[:] = control
            mujoco.mj_step(model, data, nstep=self.frame_skip)
            mujoco.mj_getState(model, data, row, PHYSICS)
        return after

    def _roll_out(self, states: Array, controls: Array) -> Array:
        """Step all states together. What `rollout` would check and tile in Python costs as much as half a step."""
        if self._pool is None:
            self._pool = Rollout(nthread=self._threads), [mujoco.MjData(self.model) for _ in range(self._threads)]
        pool, datas = self._pool
        count = len(states)
        path = np.empty((count, self.frame_skip, states.shape[1]))
        held = np.repeat(controls[:, None], self.frame_skip, axis=1)
        pool.rollout([self.model] * count, datas, states, held, skip_checks=True, nstep=self.frame_skip,
                     initial_warmstart=np.zeros((count, self.model.nv)), state=path)
        return path[:, -1].copy()

    def _info(self, state: Array, *, success: bool) -> dict[str, Any]:
        return {"is_success": success, "success": success, "distance_to_goal": float(self.goal_distance(state)[0])}
