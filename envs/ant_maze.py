"""A four-legged robot in a maze ([Matheron2020] 3.4.3): `pbcs/AntMaze-v0`."""

from pathlib import Path

import gymnasium
import mujoco
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs.maze.layout import MazeLayout
from pbcs_ompl.envs.mujoco_env import FAR, FAST, BatchedMujocoEnv
from pbcs_ompl.envs.walls_fcl import WallsFcl

ANT = Path(gymnasium.__file__).parent / "envs/mujoco/assets/ant.xml"
FRAME_SKIP = 5
"""As Gymnasium's Ant-v5: 20 steps a second."""
GOAL_RADIUS = 0.2
BIN_SIZE = 0.05
"""Edge length of exploration bins, in cells."""
WALL_HEIGHT = 2.0
HIGH = 10.0
TORSO = slice(1, 3)
"""Where the state has the position (x, y) of the torso."""


class AntMazeEnv(BatchedMujocoEnv):
    """Gymnasium's ant in a maze of `pbcs_ompl.envs.maze`: reward 1 where the torso is within 0.2 cells of the goal.

    The state is [time | qpos 15 | qvel 14], the observation [qpos | qvel], the feature (x, y) in metres. Differs from
    [OpenAI2018]'s AntMaze, of which the thesis gives no numbers: the walls are 0.1 cells thick as in the thesis's own
    mazes, and the goal is a disc; the ant may fall, as there.

    Args:
        size, maze_seed: The maze, see `MazeLayout.from_size`; by default the fixed 2x2.
        cell_size: Edge length of a cell in metres.
        reset_noise: See `BatchedMujocoEnv`; 0.1 as in Gymnasium's ant.
        terminate_on_success: End the episode in the goal.
        threads: Threads for batches; None for one on each core.
        render_mode: "rgb_array" or None.

    Raises:
        InvalidOption: an option out of its range.
    """

    feature_dims = (1, 2)
    camera = "above"

    def __init__(self, size: int = 2, maze_seed: int = 0, *, cell_size: float = 4.0, reset_noise: float = 0.1,
                 terminate_on_success: bool = True, threads: int | None = None, render_mode: str | None = None):
        if not (np.isfinite(cell_size) and cell_size >= 3.0):
            raise InvalidOption(f"cell_size={cell_size!r}: expected a number of metres >= 3; the ant is 2 m wide")
        self.layout = MazeLayout.from_size(size, maze_seed)
        self.walls = self.layout.rectangles * cell_size
        goal = np.array([0.5, 1.5] if size == 2 else [size - 0.5, size - 0.5]) * cell_size
        self.goal, self.goal_threshold = goal, GOAL_RADIUS * cell_size
        self.goal_circle = (*goal.tolist(), self.goal_threshold)
        self.bin_size = np.full(2, BIN_SIZE * cell_size)
        self.max_episode_steps = 500 * size * size
        self._terminate = terminate_on_success
        self._fcl = WallsFcl(self.walls)
        model = ant_in_maze(self.walls, cell_size, goal, self.goal_threshold)
        super().__init__(model, frame_skip=FRAME_SKIP, reset_noise=reset_noise, threads=threads,
                         render_mode=render_mode)
        self.state_low[TORSO], self.state_high[TORSO] = 0.0, size * cell_size
        self.state_low[3], self.state_high[3] = -HIGH, HIGH
        whole = np.concatenate([np.full(15, FAR), np.full(14, FAST)])
        self.observation_space = Box(-whole, whole, dtype=np.float64)

    def outcome(self, before: Array, after: Array) -> tuple[Array, BoolArray, BoolArray]:
        """Return reward 1, and the end, for the transitions [B] into the goal."""
        success = self.goal_distance(after) < self.goal_threshold
        return success.astype(np.float64), success & self._terminate, success

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


def ant_in_maze(walls: Array, cell_size: float, goal: Array, radius: float) -> "mujoco.MjModel":
    """Return Gymnasium's ant in the middle of the first cell, with walls [W, 4] and a mark on the goal."""
    spec = mujoco.MjSpec.from_file(str(ANT))
    torso = spec.body("torso")
    torso.pos = [0.5 * cell_size, 0.5 * cell_size, torso.pos[2]]
    world = spec.worldbody
    for x0, y0, x1, y1 in walls.tolist():
        world.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[(x0 + x1) / 2, (y0 + y1) / 2, WALL_HEIGHT / 2],
                       size=[(x1 - x0) / 2, (y1 - y0) / 2, WALL_HEIGHT / 2], conaffinity=1, rgba=[0.3, 0.35, 0.4, 1.0])
    world.add_site(name="goal", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[*goal.tolist(), 0.01],
                   size=[radius, 0.01, 0.0], rgba=[0.2, 0.7, 0.3, 0.6])
    extent = walls.max()
    world.add_camera(name="above", pos=[extent / 2, extent / 2, 1.3 * extent], xyaxes=[1, 0, 0, 0, 1, 0], fovy=50)
    return spec.compile()
