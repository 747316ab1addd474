"""A quadrotor in a vertical plane, among walls: `pbcs/PlanarQuadrotor-v0`."""

from collections.abc import Sequence

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array
from pbcs_ompl.envs import quadrotor_kernels
from pbcs_ompl.envs.body_env import BodyEnv
from pbcs_ompl.envs.upright_robot import UprightRobot

EXTENT = 6.0
HALF_EDGES = 0.3, 0.06
GRAVITY = 9.81
AUTHORITY = 0.8
LEVERAGE = 1.0
DAMPING, DRAG = 5.0, 0.5
FASTEST, FASTEST_TURN = 4.0, 6.0
SECONDS, PARTS = 0.05, 4
NEAR = 0.4
BIN_SIZES = 0.4, 0.4, 0.8, 0.8
START, GOAL = (1.0, 1.0, 0.0), (5.0, 5.0)
OBSTACLES = ((1.9, 0.0, 2.1, 3.0), (3.9, 3.0, 4.1, 6.0))
"""A wall from the floor, and one from the ceiling: over the first, under the second."""
EPISODE_STEPS = 600


class PlanarQuadrotorEnv(BodyEnv):
    """Two rotors on a bar that fly to a place: reward 1 where the centre is within 0.4 m of the goal.

    The state is (x, z, tilt, vx, vz, turning rate) in metres, radians and seconds: the tilt counter-clockwise, in
    [-pi, pi), speeds within 4 m/s, the turning rate within 6 rad/s. The controls are the left and the right rotor: 0
    lifts half of the weight, -1 a tenth and 1 nine tenths. 20 steps a second. What is explored are place and speed.
    Where the bar, 0.6 m long, touches a wall, it has crashed: the episode ends. Speed and tilt in the goal are free.
    The observation is the state, then the cosine and the sine of the tilt.

    Args:
        obstacles: Rectangles (x0, z0, x1, z1) in [0, 6]^2; by default a wall from the floor and one from the ceiling.
        start: Pose (x, z, tilt) of the start, at rest.
        goal: Centre (x, z) of the goal.
        terminate_on_success: End the episode in the goal.
        render_mode: "rgb_array" or None.

    Raises:
        InvalidOption: obstacles that are no rectangles in the world, or a goal that is no place.
        InvalidState: a start or goal that touches a wall, or is outside.

    Source: the planar quadrotor of Tedrake, Underactuated Robotics, 3.3, with the inertia of a short bar.
    """

    feature_dims = (0, 1, 3, 4)
    kernel = quadrotor_kernels.compiled_step
    robot = UprightRobot.of(observation_size=8, action_size=2)

    def __init__(self, *, obstacles: Sequence[Sequence[float]] = OBSTACLES, start: Sequence[float] = START,
                 goal: Sequence[float] = GOAL, terminate_on_success: bool = True, render_mode: str | None = None):
        if np.shape(goal) != (2,) or np.shape(start) != (3,):
            raise InvalidOption(f"start={start!r}, goal={goal!r}: expected a pose (x, z, tilt) and a place (x, z)")
        self.bin_size = np.array(BIN_SIZES)
        super().__init__(
            (EXTENT, *goal, NEAR, terminate_on_success, *HALF_EDGES, GRAVITY, AUTHORITY, LEVERAGE, DAMPING,
             DRAG, FASTEST, FASTEST_TURN, SECONDS, PARTS),
            extent=EXTENT, obstacles=obstacles, half_edges=HALF_EDGES, start=start,
            speeds=[(-FASTEST, FASTEST), (-FASTEST, FASTEST), (-FASTEST_TURN, FASTEST_TURN)],
            goal=(float(goal[0]), float(goal[1]), NEAR), max_episode_steps=EPISODE_STEPS, render_mode=render_mode)
        self._checked("goal", [*goal, 0.0, 0.0, 0.0, 0.0])

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] of states [B, 6] to the goal, in its radius."""
        return quadrotor_kernels.goal_distances(self.settings, np.ascontiguousarray(states, dtype=np.float64))
