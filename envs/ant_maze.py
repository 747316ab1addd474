"""A four-legged robot in a maze ([Matheron2020] 3.4.3): `pbcs/AntMaze-v0`."""

import mujoco
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs.ant import FRAME_SKIP, ant_robot, ant_spec
from pbcs_ompl.envs.maze.layout import MazeLayout
from pbcs_ompl.envs.maze_maps import MAPS, MazeMap
from pbcs_ompl.envs.mujoco_env import FAR, FAST, BatchedMujocoEnv
from pbcs_ompl.envs.walls_fcl import WallsFcl

GOAL_RADIUS = 0.2
"""In cells, where no radius is given."""
BIN_SIZE = 0.05
"""Edge length of exploration bins, in cells."""
WALL_HEIGHT = 2.0
HIGH = 10.0
TORSO = slice(1, 3)
"""Where the state has the position (x, y) of the torso."""
HEALTHY_HEIGHT = 0.2, 1.0
"""Of the torso in metres, as in Gymnasium's Ant-v5."""
UPRIGHT = 0.2
"""An ant has fallen where the cosine of the angle between its torso's z axis and the vertical is smaller (ours)."""
ANTS = ("gymnasium", "d4rl")
INTEGRATORS = ("RK4", "Euler")


class AntMazeEnv(BatchedMujocoEnv):
    """An ant in a maze: reward 1 where the torso is within `goal_radius` of the goal.

    The state is [time | qpos 15 | qvel 14], the observation [qpos | qvel], the feature (x, y) in metres. Differs from
    [OpenAI2018]'s AntMaze, of which the thesis gives no numbers: the walls are 0.1 cells thick as in the thesis's own
    mazes, and the goal is a disc; the ant may fall, as there.

    Args:
        size, maze_seed: The maze, see `MazeLayout.from_size`; by default the fixed 2x2.
        map: "umaze", "medium" or "large" of gymnasium-robotics, or "open", a square of `size` cells without walls
            inside; None for the maze of `size` and `maze_seed`.
        ant: "gymnasium" (gear 150, 20 steps a second) or "d4rl" (controls within +-30, gear 1, ten steps a second).
        cell_size: Edge length of a cell in metres.
        goal_radius: In metres; None for 0.2 cells. That of gymnasium-robotics is 0.45.
        reset_noise: See `BatchedMujocoEnv`; 0.1 as in Gymnasium's ant.
        terminate_on_success: End the episode in the goal.
        terminate_when_unhealthy: End the episode where the torso is not 0.2 to 1 m high, as in Gymnasium's ant, or
            leans by more than 78 degrees.
        integrator: "RK4", or "Euler", which takes a quarter of the time.
        threads: Threads for batches; None for one on each core.
        render_mode: "rgb_array" or None.

    Raises:
        InvalidOption, UnknownName: an option out of its range.
    """

    feature_dims = (1, 2)
    camera = "above"
    robot = ant_robot()

    def __init__(self, size: int = 2, maze_seed: int = 0, *, map: str | None = None, ant: str = "gymnasium",
                 cell_size: float = 4.0, goal_radius: float | None = None, reset_noise: float = 0.1,
                 terminate_on_success: bool = True, terminate_when_unhealthy: bool = False, integrator: str = "RK4",
                 threads: int | None = None, render_mode: str | None = None):
        if not (np.isfinite(cell_size) and cell_size >= 3.0):
            raise InvalidOption(f"cell_size={cell_size!r}: expected a number of metres >= 3; the ant is 2 m wide")
        if goal_radius is not None and not (np.isfinite(goal_radius) and goal_radius > 0):
            raise InvalidOption(f"goal_radius={goal_radius!r}: expected a finite number of metres above 0, or None")
        for name, value, choices in (("ant", ant, ANTS), ("integrator", integrator, INTEGRATORS)):
            if value not in choices:
                raise UnknownName(name, value, choices)
        layout = _layout(size, maze_seed, map)
        self.walls = layout.walls * cell_size
        self.goal = np.array(layout.goal) * cell_size
        self.goal_threshold = GOAL_RADIUS * cell_size if goal_radius is None else float(goal_radius)
        self.goal_circle = (*self.goal.tolist(), self.goal_threshold)
        self.bin_size = np.full(2, BIN_SIZE * cell_size)
        self.max_episode_steps = 500 * size * size if map is None else int(125 * layout.extent[0] * layout.extent[1])
        self._terminate, self._terminate_when_unhealthy = terminate_on_success, terminate_when_unhealthy
        self._fcl = WallsFcl(self.walls)
        spec = ant_spec(ant)
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        _add_maze(spec, self.walls, np.array(layout.start) * cell_size, self.goal, self.goal_threshold)
        super().__init__(spec.compile(), frame_skip=FRAME_SKIP, reset_noise=reset_noise, threads=threads,
                         render_mode=render_mode)
        self.state_low[TORSO], self.state_high[TORSO] = 0.0, np.array(layout.extent) * cell_size
        self.state_low[3], self.state_high[3] = -HIGH, HIGH
        whole = np.concatenate([np.full(15, FAR), np.full(14, FAST)])
        self.observation_space = Box(-whole, whole, dtype=np.float64)

    def outcome(self, before: Array, after: Array) -> tuple[Array, BoolArray, BoolArray]:
        """Return reward 1 for the transitions [B] into the goal, and where the episode ends."""
        success = self.goal_distance(after) < self.goal_threshold
        terminated = success & self._terminate
        if self._terminate_when_unhealthy:
            terminated |= ~healthy(after)
        return success.astype(np.float64), terminated, success

    def observe(self, states: Array) -> Array:
        """Return [qpos | qvel] [B, 29]."""
        return np.array(states, dtype=np.float64)[:, 1:]

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] from the torso to the centre of the goal in metres."""
        away = np.asarray(states)[:, TORSO] - self.goal
        return np.hypot(away[:, 0], away[:, 1])

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are within the bounds with the torso's centre in no wall [B]."""
        valid = super().is_valid(states)
        valid[valid] = ~self._fcl.contains(np.asarray(states)[valid][:, TORSO])
        return valid


def healthy(states: Array) -> BoolArray:
    """Return in which states [B, D] the ant is finite, 0.2 to 1 m high, and has not fallen over [B]."""
    states = np.asarray(states)
    low, high = HEALTHY_HEIGHT
    upright = 1.0 - 2.0 * (states[:, 5] ** 2 + states[:, 6] ** 2)
    within: BoolArray = (low <= states[:, 3]) & (states[:, 3] <= high) & (upright >= UPRIGHT)
    return within & np.isfinite(states).all(axis=1)


def _layout(size: int, maze_seed: int, name: str | None) -> MazeMap:
    if name is None:
        maze = MazeLayout.from_size(size, maze_seed)
        goal = (0.5, 1.5) if size == 2 else (size - 0.5, size - 0.5)
        return MazeMap(maze.rectangles, (size, size), (0.5, 0.5), goal)
    if name not in (*MAPS, "open"):
        raise UnknownName("map", name, [*MAPS, "open"])
    if name == "open":
        MazeLayout.from_size(size, maze_seed)  # refuses sizes out of range
        return MazeMap.open(size)
    return MazeMap.named(name)


def _add_maze(spec: "mujoco.MjSpec", walls: Array, start: Array, goal: Array, radius: float) -> None:
    """Put the ant of a model at `start`, and add walls [W, 4], a mark on the goal and a camera."""
    torso = spec.body("torso")
    torso.pos = [*start.tolist(), torso.pos[2]]
    world = spec.worldbody
    for x0, y0, x1, y1 in walls.tolist():
        world.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[(x0 + x1) / 2, (y0 + y1) / 2, WALL_HEIGHT / 2],
                       size=[(x1 - x0) / 2, (y1 - y0) / 2, WALL_HEIGHT / 2], conaffinity=1, rgba=[0.3, 0.35, 0.4, 1.0])
    world.add_site(name="goal", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[*goal.tolist(), 0.01],
                   size=[radius, 0.01, 0.0], rgba=[0.2, 0.7, 0.3, 0.6])
    extent = walls.max()
    world.add_camera(name="above", pos=[extent / 2, extent / 2, 1.3 * extent], xyaxes=[1, 0, 0, 0, 1, 0], fovy=50)
