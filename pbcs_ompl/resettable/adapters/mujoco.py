"""The adapter for every environment in which MuJoCo runs: Gymnasium's, gymnasium-robotics', dm_control's, yours."""

import math
import os
import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapters.get_set import GetSetStateModel, Step
from pbcs_ompl.resettable.adapters.mujoco_probe import find_read_first
from pbcs_ompl.resettable.adapters.mujoco_state import PHYSICS, ModelParts, Physics
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.memory.exploration import SEEDS, Changes, episodes, plain_copies
from pbcs_ompl.resettable.memory.memory import Memory
from pbcs_ompl.resettable.observations import has_goals
from pbcs_ompl.resettable.rules import FeatureRule, feature_rule
from pbcs_ompl.resettable.simulation import Simulation, simulation_of
from pbcs_ompl.resettable.supported import task_env
from pbcs_ompl.resettable.task_env import bare

BROKEN = "4.0.0"
"""The version that computes wrong accelerations where the constraint Jacobian is sparse."""


class MujocoEnv(RestorableEnv):
    """Saves [integration state | what is read before it is written | what changes in the model | attributes].

    What beside MuJoCo's integration state is state is found by exploration; see `mujoco_state` and `memory`.
    """

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        import mujoco

        self._mujoco: Any = mujoco  # its functions have no types
        self.inner = inner
        self._simulation = self._simulation_in(inner)
        self._simulation.check_observed()
        if mujoco.__version__ == BROKEN and self._mujoco.mj_isSparse(self._simulation.model):
            warnings.warn(f"mujoco {BROKEN} computes wrong accelerations for this model, whose constraint Jacobian is "
                          f"sparse; install mujoco 4.0.1 or newer, or 3.x", stacklevel=2)
        before, model = plain_copies(inner), self._simulation.model
        self._physics, self._parts = Physics(mujoco, model), ModelParts(model)
        self._first_physics = self._physics.save(model, self._simulation.data)
        inner.reset(seed=SEEDS[0])
        self._parts.look(model, after_reset=True)
        self._has_goal = isinstance(given := getattr(inner, "goal", None), np.ndarray) and given.ndim == 1
        changes = Changes(inner)
        for event in episodes(inner):
            changes.add(event)
            self._parts.look(model, after_reset=event == "reset")
        self._memory = Memory(inner, changes, before, known=(self._simulation.data,))
        self._read_first = find_read_first(self._simulation, self._physics, self._parts, self._memory)
        self.goal_radius = float(getattr(inner, "distance_threshold", MAZE_GOAL_RADIUS))
        super().__init__(inner, goal, feature)
        self.walls = wall_rectangles(inner.maze) if has_map(inner) else np.empty((0, 4))

    def default_feature(self) -> FeatureRule:
        """Return the achieved goal where there is one, else the first two positions."""
        return feature_rule(self.usual_rule())

    def usual_rule(self) -> str:
        """Return the achieved goal where there is one, else the first two positions."""
        if has_goals(self.inner):
            return "achieved_goal"
        return "qpos[0:2]" if self._simulation.model.nq > 1 else "qpos[0]"

    def angles(self) -> tuple[str, int, Sequence[int]]:
        """Return the positions of hinges without limits."""
        model, hinge = self._simulation.model, int(self._mujoco.mjtJoint.mjJNT_HINGE)
        free = (model.jnt_type == hinge) & (model.jnt_limited == 0)
        return "qpos", int(model.nq), model.jnt_qposadr[free].tolist()

    def attach(self) -> None:
        """Let what is saved be that of `inner`."""
        self._simulation, self._memory = self._simulation_in(self.inner), self._memory.of(self.inner)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Reset the environment as if nothing had run in it before."""
        self._memory.clear()
        self._parts.clear(self._simulation.model)
        self._physics.load(self._simulation.model, self._simulation.data, self._first_physics)
        return super().reset(seed=seed, options=options)

    def save(self) -> Array:
        """Return physics, what is read before it is written, what changes in the model, and attributes."""
        model, data = self._simulation.model, self._simulation.data
        return np.concatenate([self._physics.save(model, data), self._read_first.save(data), self._parts.save(model),
                               self._memory.save()])

    def load(self, saved: Array) -> None:
        """Go back to what `save` returned; positions of bodies are computed, but for those that are saved."""
        sizes = (self._physics.size, self._read_first.size, self._parts.size, self._memory.size)
        if len(saved) != sum(sizes) or not np.isfinite(saved).all():
            raise InvalidState(f"expected {sum(sizes)} finite numbers for {type(self.inner).__name__}")
        a, b, c = sizes[0], sizes[0] + sizes[1], sizes[0] + sizes[1] + sizes[2]
        model, data = self._simulation.model, self._simulation.data
        self._parts.load(model, saved[b:c])
        self._memory.load(saved[c:])
        self._physics.load(model, data, saved[:a])
        self._simulation.complete()
        self._read_first.load(data, saved[a:b])

    def observation(self) -> Any:
        """Return what the environment observes when all is computed but the numbers that are saved."""
        model, data = self._simulation.model, self._simulation.data
        physics, read_first = self._physics.save(model, data), self._read_first.save(data)
        self._simulation.forward()
        self._physics.load(model, data, physics)  # the warm start
        self._read_first.load(data, read_first)
        return self._simulation.observed()

    def check_constants(self) -> None:
        """Refuse an environment of which something else has changed than what is saved."""
        self._parts.check(self._simulation.model, type(bare(self.inner)).__name__)
        self._memory.check_constants()

    def named_state(self, env: Any) -> dict[str, Any]:
        """Return the parts of the state of an environment of this class, by name."""
        simulation = self._simulation_in(env)
        data = simulation.data
        physics = {name: np.array(getattr(data, name)) for name in sorted(PHYSICS) if hasattr(data, name)}
        return {"time": data.time, **physics, **self._parts.values(simulation.model),
                **self._read_first.values(data), **self._memory.values(env)}

    def render(self) -> Any:
        """Render the environment; a camera that follows the robot is where the restored robot is."""
        self._mujoco.mj_camlight(self._simulation.model, self._simulation.data)
        return self.inner.render()

    def reported_goal_distance(self, observation: Any) -> float | None:
        """Return the distance between achieved and desired goal, where they are points."""
        if not isinstance(observation, dict) or not self._has_goal:
            return None
        gap = observation["achieved_goal"] - observation["desired_goal"]
        return math.sqrt(gap.dot(gap))

    def feature_box(self) -> tuple[Array, Array] | None:
        """Return the extent of a maze, if that is what is explored."""
        if self.feature_rule is not None or not has_map(self.inner):
            return None
        return map_bounds(self.inner.maze)

    def difference(self, states: Array, others: Array) -> Array:
        """Return MuJoCo's own differences of positions [B, nv], in which turns of a free joint are angles."""
        model, nq = self._simulation.model, self._simulation.model.nq
        rows = np.empty((len(states), model.nv))
        for row, state, other in zip(rows, states, others, strict=True):  # saved states begin with the time
            self._mujoco.mj_differentiatePos(model, row, 1.0, np.array(other[1:1 + nq]), np.array(state[1:1 + nq]))
        return rows

    @staticmethod
    def _simulation_in(env: Any) -> Simulation:
        simulation = simulation_of(env)
        assert simulation is not None
        return simulation


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
            self._others.append(self.env.again(task_env(self.make_env(), self.spec.reset_options)))
        self._pool = ThreadPoolExecutor(self._threads - 1, thread_name_prefix="mujoco")


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
