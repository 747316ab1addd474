"""The adapter for every environment that shows a MuJoCo `model` and `data`: Gymnasium's, gymnasium-robotics', yours."""

import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.errors import InvalidState, MissingDependency, NotResettable
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.adapters.get_set import GetSetStateModel, Step
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.rules import FeatureRule, Outcome, feature_rule
from pbcs_ompl.resettable.supported import task_env
from pbcs_ompl.resettable.task_env import bare

MOVED_BY_RESET = ("body_pos", "body_quat", "site_pos", "geom_pos")
"""Parts of a model that environments move about in `reset`: goals, hinges, boards."""
BROKEN = "4.0.0"
"""The version that computes wrong accelerations where the constraint Jacobian is sparse."""


def is_mujoco_env(env: Any) -> bool:
    """Return whether `env` has a MuJoCo model and its data."""
    return type(getattr(env, "model", None)).__name__ == "MjModel" and hasattr(env, "data")


class MujocoEnv(RestorableEnv):
    """Saves [FULLPHYSICS and warm start | what `reset` moves in the model | the goal].

    The warm start is what makes a restored simulation continue bit for bit. Before each step the positions of
    bodies are computed afresh, so that rewards that read them depend on the state alone; physics is untouched.
    """

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        import mujoco

        self._mujoco: Any = mujoco  # its functions have no types
        self._kinds = _state_kinds(mujoco, inner.model)
        self._physics = int(self._mujoco.mj_stateSize(inner.model, self._kinds))
        self._parts, self._has_goal = _moved_parts(inner)
        self._loaded = False
        self.goal_radius = float(getattr(inner, "distance_threshold", MAZE_GOAL_RADIUS))
        if mujoco.__version__ == BROKEN and self._mujoco.mj_isSparse(inner.model):
            warnings.warn(f"mujoco {BROKEN} computes wrong accelerations for this model, whose constraint Jacobian is "
                          f"sparse; install mujoco 4.0.1 or newer, or 3.x", stacklevel=2)
        super().__init__(inner, goal, feature)
        self.walls = wall_rectangles(inner.maze) if has_map(inner) else np.empty((0, 4))

    def default_feature(self) -> FeatureRule:
        """Return the achieved goal where there is one, else the first two positions."""
        if isinstance(bare(self.inner).observation_space, gymnasium.spaces.Dict):
            return feature_rule("achieved_goal")
        return feature_rule("qpos[0:2]" if self.inner.model.nq > 1 else "qpos[0]")

    def save(self) -> Array:
        """Return physics, moved parts and goal."""
        self._loaded = False
        return self._save()

    def load(self, saved: Array) -> None:
        """Go back to what `save` returned; positions of bodies are up to date afterwards."""
        model, data, at = self.inner.model, self.inner.data, self._physics
        if len(saved) < at or not np.isfinite(saved).all():
            raise InvalidState(f"expected {at} or more finite numbers for {type(self.inner).__name__}")
        for name, rows in self._parts:
            part = getattr(model, name)[rows]
            getattr(model, name)[rows] = saved[at:at + part.size].reshape(part.shape)
            at += part.size
        if self._has_goal:
            self.inner.goal[:] = saved[at:]
        self._mujoco.mj_setState(model, data, saved[:self._physics], self._kinds)
        self._mujoco.mj_kinematics(model, data)
        self._mujoco.mj_comPos(model, data)
        self._loaded = True

    def step(self, action: Array) -> Any:
        """Make one step of the environment."""
        if not self._loaded:
            self.load(self._save())
        self._loaded = False
        return super().step(action)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Reset the environment."""
        self._loaded = False
        return super().reset(seed=seed, options=options)

    def observation(self) -> Any:
        """Return what the environment observes after `mj_forward`; contact forces are those of the state itself."""
        self._mujoco.mj_forward(self.inner.model, self.inner.data)
        self._mujoco.mj_rnePostConstraint(self.inner.model, self.inner.data)
        agent = _agent(self.inner)
        if agent is None:
            return self.inner._get_obs()
        seen = agent._get_obs()
        return self.inner._get_obs(seen[0] if isinstance(seen, tuple) else seen)

    def render(self) -> Any:
        """Render the environment; a camera that follows the robot is where the restored robot is."""
        self._mujoco.mj_camlight(self.inner.model, self.inner.data)
        return self.inner.render()

    def reported_goal_distance(self, outcome: Outcome) -> float | None:
        """Return the distance between achieved and desired goal, where they are points."""
        if not isinstance(outcome.observation, dict) or not self._has_goal:
            return None
        return float(np.linalg.norm(outcome.observation["achieved_goal"] - outcome.observation["desired_goal"]))

    def feature_box(self) -> tuple[Array, Array] | None:
        """Return the extent of a maze, if that is what is explored."""
        if self.feature_rule is not None or not has_map(self.inner):
            return None
        return map_bounds(self.inner.maze)

    def difference(self, states: Array, others: Array) -> Array:
        """Return MuJoCo's own differences of positions [B, nv], in which turns of a free joint are angles."""
        model, nq = self.inner.model, self.inner.model.nq
        rows = np.empty((len(states), model.nv))
        for row, state, other in zip(rows, states, others, strict=True):  # saved states begin with the time
            self._mujoco.mj_differentiatePos(model, row, 1.0, np.array(other[1:1 + nq]), np.array(state[1:1 + nq]))
        return rows

    def _save(self) -> Array:
        saved = np.empty(self._physics)
        self._mujoco.mj_getState(self.inner.model, self.inner.data, saved, self._kinds)
        parts = [getattr(self.inner.model, name)[rows].ravel() for name, rows in self._parts]
        goal = [self.inner.goal.ravel()] if self._has_goal else []
        return np.concatenate([saved, *parts, *goal])


MAZE_GOAL_RADIUS = 0.45
"""The mazes of gymnasium-robotics call a success what is that close."""


class MujocoModel(GetSetStateModel):
    """A `MujocoEnv` whose batches are stepped on all cores, each by an instance of the environment of its own.

    MuJoCo lets other Python threads run while it steps. Because a restored state continues bit for bit, results do
    not depend on the size of a batch or the number of threads.
    """

    def __init__(self, env: MujocoEnv, threads: int | None = None):
        super().__init__(env)
        self._threads = len(os.sched_getaffinity(0)) if threads is None else threads
        self._others: list[MujocoEnv] = []
        self._pool: ThreadPoolExecutor | None = None

    def _steps(self, states: Array, controls: Array) -> list[Step]:
        if min(len(states), self._threads) < 2 or self.make_env is None:
            return super()._steps(states, controls)
        if self._pool is None:
            self._open_pool()
        envs, actions = [self.env, *self._others][:len(states)], self.actions.to_actions(controls)
        cuts = np.linspace(0, len(states), len(envs) + 1).astype(int)
        jobs = [self._pool.submit(self._loop, env, states[a:b], actions[a:b])  # type: ignore[union-attr]
                for env, a, b in zip(envs[1:], cuts[1:-1], cuts[2:], strict=True)]
        done = self._loop(envs[0], states[:cuts[1]], actions[:cuts[1]])
        return done + [step for job in jobs for step in job.result()]

    def _open_pool(self) -> None:
        assert self.make_env is not None
        for _ in range(self._threads - 1):
            inner = task_env(self.make_env(), self.spec.reset_options)
            self._others.append(MujocoEnv(inner, self.env.goal_rule, self.env.feature_rule))
        self._pool = ThreadPoolExecutor(self._threads - 1, thread_name_prefix="mujoco")


def _state_kinds(mujoco: Any, model: Any) -> int:
    kinds = int(mujoco.mjtState.mjSTATE_FULLPHYSICS) | int(mujoco.mjtState.mjSTATE_WARMSTART)
    if model.nmocap:
        kinds |= int(mujoco.mjtState.mjSTATE_MOCAP_POS) | int(mujoco.mjtState.mjSTATE_MOCAP_QUAT)
    if model.neq:
        kinds |= int(mujoco.mjtState.mjSTATE_EQ_ACTIVE)
    return kinds


def _moved_parts(env: Any) -> tuple[list[tuple[str, IndexArray]], bool]:
    """Return the rows of the model that two resets leave different, and whether the environment has a goal."""
    seen = []
    for seed in (0, 1, 2):
        env.reset(seed=seed)
        seen.append({name: getattr(env.model, name).copy() for name in MOVED_BY_RESET})
    parts = []
    for name in MOVED_BY_RESET:
        moved = np.any([(seen[0][name] != later[name]).any(axis=1) for later in seen[1:]], axis=0)
        if moved.any():
            parts.append((name, np.flatnonzero(moved)))
    goal = getattr(env, "goal", None)
    return parts, isinstance(goal, np.ndarray) and goal.ndim == 1


def _agent(env: Any) -> Any:
    """Return the environment inside a maze of gymnasium-robotics, None for others."""
    for name in ("point_env", "ant_env"):
        if hasattr(env, name):
            return getattr(env, name)
    return None


def check_observes(env: Any) -> None:
    """Refuse an environment whose observation cannot be asked for.

    Raises:
        MissingDependency: mujoco is not installed.
        NotResettable: there is no `_get_obs`.
    """
    try:
        import mujoco  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingDependency("this environment needs mujoco: pip install 'pbcs-ompl[mujoco]'") from error
    if not callable(getattr(env, "_get_obs", None)):
        raise NotResettable(f"{type(env).__name__} has no `_get_obs()`, so a restored state cannot be observed; "
                              f"add it, or get_env_state and set_env_state")


def has_map(env: Any) -> bool:
    """Return whether `env` is a maze of gymnasium-robotics."""
    return hasattr(getattr(env, "maze", None), "maze_map")


def map_bounds(maze: Any) -> tuple[Array, Array]:
    """Return the corners (x, y) of the map."""
    high = np.array([maze.x_map_center, maze.y_map_center], dtype=np.float64)
    return -high, high


def wall_rectangles(maze: Any) -> Array:
    """Return the cells that are walls [W, 4] (x0, y0, x1, y1)."""
    half = maze.maze_size_scaling / 2
    centres = [maze.cell_rowcol_to_xy(np.array([row, column])) for row, cells in enumerate(maze.maze_map)
               for column, cell in enumerate(cells) if cell == 1]
    return np.array([[x - half, y - half, x + half, y + half] for x, y in centres], dtype=np.float64).reshape(-1, 4)
