"""The continuous N x N mazes of [Matheron2020] 4.1, 5.4 and 7.3: `pbcs/Maze-v0`."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar, Literal

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, did_you_mean
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs.maze import kernels
from pbcs_ompl.envs.maze.fcl_move import move_by_fcl
from pbcs_ompl.envs.maze.layout import MAZES_KEPT, MazeLayout
from pbcs_ompl.envs.point_env import MAX_STEP, CompiledStep, PointEnv
from pbcs_ompl.envs.point_kernels import WholeStep, whole_step
from pbcs_ompl.envs.wall_grid import WallGrid, build_wall_grid
from pbcs_ompl.envs.walls_fcl import WallsFcl

CollisionResponse = Literal["stay", "slide"]
Collision = Literal["kernel", "fcl"]


class MazeEnv(PointEnv):
    """s' = s + a unless the segment [s, s + a] touches a wall; reward 1 where ||s' - goal|| < 0.2.

    Args:
        size: Number N of cells along each axis, 2 to 50 (default 2): the fixed U for 2, the hard S for 3,
            else the maze that a recursive backtracker makes from `maze_seed`.
        maze_seed: Seed of the maze alone; the seed of `reset` does not change the maze.
        layout: A drawing in place of size and maze_seed, as `render` prints it for "ansi" (see
            `MazeLayout.from_drawing`).
        start: Start position, by default (.5, .5).
        goal: Centre of the goal, by default (N - .5, N - .5), or (.5, 1.5) for N = 2.
        wall_penalty: Added to the reward of a step that hits a wall: 0 (default) in chapter 5, -1 in 4 and 7.
        collision_response: "stay": a step that hits a wall does not move (the thesis). "slide": it stops 1e-6
            before the wall (4.7, "traveling in the direction given by a until reaching the wall").
        terminate_on_success: End the episode in the goal. Differs: the thesis has no terminal states (False).
        collision: What decides whether a step hits a wall: the compiled kernel, or FCL (slow).
        normalize_actions: Take actions in [-1, 1]^2, scaled by 0.1.
        render_mode: "rgb_array", "ansi" or None.

    Raises:
        InvalidOption: an option out of its range.
        InvalidState: a start or goal inside a wall or outside of the maze.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": ["rgb_array", "ansi"], "render_fps": 30}

    def __init__(self, size: int | None = None, maze_seed: int = 0, layout: Sequence[str] | None = None, *,
                 start: Sequence[float] = (0.5, 0.5), goal: Sequence[float] | None = None,
                 wall_penalty: float = 0.0, collision_response: CollisionResponse = "stay",
                 terminate_on_success: bool = True, collision: Collision = "kernel",
                 normalize_actions: bool = False, render_mode: str | None = None):
        _check_choice("collision_response", collision_response, ("stay", "slide"))
        _check_choice("collision", collision, ("kernel", "fcl"))
        self.layout = _layout(size, maze_seed, layout)
        self.collision = collision
        self._fcl = _fcl_of(self.layout)
        self._slide = collision_response == "slide"
        size = self.layout.size
        self._grid = _grid_of(self.layout)
        default_goal = (0.5, 1.5) if size == 2 else (size - 0.5, size - 0.5)
        super().__init__(size, start, default_goal if goal is None else goal, wall_penalty=wall_penalty,
                         terminate_on_success=terminate_on_success, normalize_actions=normalize_actions,
                         max_episode_steps=max(100, 20 * size * size),
                         own_settings=(self._slide, self._grid.cells), render_mode=render_mode)

    @property
    def walls(self) -> Array:
        """Rectangles [W, 4] (x0, y0, x1, y1)."""
        return self.layout.rectangles

    def move(self, states: Array, controls: Array) -> tuple[Array, BoolArray]:
        """Return the next states [B, 2] and whether a wall was hit [B]."""
        if self.collision == "fcl":
            return move_by_fcl(self._fcl, states, states + self.displacements(controls), self._slide)
        return kernels.move(self._grid.rectangles, self._grid.lists, self.settings, states, controls)

    def move_one(self, x: float, y: float, a: float, b: float) -> WholeStep:
        """Return what `move` does with one point, and what that shows."""
        if self.collision == "fcl":
            after, hits = self.move(np.array([[x, y]]), np.array([[a, b]]))
            return whole_step(self.settings, float(after[0, 0]), float(after[0, 1]), bool(hits[0]))
        rectangles, lists, _ = self._grid
        return kernels.step_one(rectangles, lists, self.settings, x, y, a, b)

    def compiled_step(self) -> CompiledStep | None:
        """Return the step as a function for compiled planners; None with collision="fcl"."""
        if self.collision == "fcl":
            return None
        return kernels.compiled_step, self.settings, self._grid.rectangles, self._grid.lists

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, 2] are within the bounds and, by FCL, in no wall [B]."""
        valid = self.in_bounds(states)
        valid[valid] = ~self._fcl.contains(np.asarray(states)[valid])
        return valid

    def render(self) -> Any:
        """Return an image [480, 480, 3] for "rgb_array", a drawing with agent A and goal G for "ansi"."""
        if self.render_mode != "ansi":
            return super().render()
        goal = self.goal_circle
        marks = {} if goal is None else {(int(goal[0]), int(goal[1])): "G"}
        marks[int(self._position[0]), int(self._position[1])] = "A"
        return "\n".join(self.layout.draw(marks)) + "\n"


@lru_cache(MAZES_KEPT)
def _fcl_of(layout: MazeLayout) -> WallsFcl:
    return WallsFcl(layout.rectangles)


@lru_cache(MAZES_KEPT)
def _grid_of(layout: MazeLayout) -> WallGrid:
    return build_wall_grid(layout.rectangles, layout.size, MAX_STEP)


def _layout(size: int | None, maze_seed: int, drawing: Sequence[str] | None) -> MazeLayout:
    if drawing is None:
        return MazeLayout.from_size(2 if size is None else size, maze_seed)
    layout = MazeLayout.from_drawing(drawing)
    if size not in (None, layout.size):
        raise InvalidOption(f"size={size!r}, but the layout has size {layout.size}; leave size out")
    return layout


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InvalidOption(f"{name}={value!r}{did_you_mean(value, choices)}")
