"""A car among walls in the plane: `pbcs/CarPark-v0`."""

from collections.abc import Sequence

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array
from pbcs_ompl.envs import car_kernels
from pbcs_ompl.envs.body_env import BodyEnv
from pbcs_ompl.envs.car_robot import CarRobot

EXTENT = 8.0
HALF_EDGES = 0.5, 0.25
WHEELBASE, AHEAD = 0.6, 0.3
SLOWEST, FASTEST, ACCELERATION = -1.0, 2.0, 2.0
STEERING = 0.6
SECONDS, PARTS = 0.1, 4
NEAR, ALIGNED = 0.3, 0.3
BIN_SIZES = 0.4, 0.4, np.pi / 6
START, GOAL = (1.0, 1.0, 0.0), (4.0, 6.9, np.pi / 2)
OBSTACLES = ((0.0, 3.6, 5.6, 3.9), (2.4, 6.2, 3.2, 7.8), (4.8, 6.2, 5.6, 7.8))
"""A wall with one way past it, and two cars on both sides of the place to park."""
EPISODE_STEPS = 400


class CarParkEnv(BodyEnv):
    """A kinematic bicycle that parks: reward 1 where the pose is within 0.3 m and 0.3 rad of the goal's.

    The state is (x, y, heading, speed): the middle of the rear axle in metres, radians in [-pi, pi), metres a second
    from -1 to 2. The controls are the acceleration, in 2 m/s^2, and the steering angle, in 0.6 rad; ten steps a second.
    The car is 1 m long, 0.5 m wide; where it would touch a wall it stands still, and can drive on. The speed in the
    goal is free. The observation is the state, then the cosine and the sine of the heading.

    Args:
        obstacles: Rectangles (x0, y0, x1, y1) in [0, 8]^2; by default a wall and two parked cars.
        start: Pose (x, y, heading) of the start, at rest.
        goal: Pose of the goal.
        terminate_on_success: End the episode in the goal.
        render_mode: "rgb_array" or None.

    Raises:
        InvalidOption: obstacles that are no rectangles in the world, or a goal that is no pose.
        InvalidState: a start or goal that touches a wall, or is outside.

    Source: the kinematic bicycle of LaValle, Planning Algorithms (2006), 13.1.2.1, with the speed as a state.
    """

    feature_dims = (0, 1, 2)
    feature_periods = (0.0, 0.0, 2.0 * np.pi)
    kernel = car_kernels.compiled_step
    robot = CarRobot(turning=WHEELBASE / np.tan(STEERING))

    def __init__(self, *, obstacles: Sequence[Sequence[float]] = OBSTACLES, start: Sequence[float] = START,
                 goal: Sequence[float] = GOAL, terminate_on_success: bool = True, render_mode: str | None = None):
        if np.shape(goal) != (3,) or np.shape(start) != (3,):
            raise InvalidOption(f"start={start!r}, goal={goal!r}: expected poses (x, y, heading)")
        self.bin_size = np.array(BIN_SIZES)
        super().__init__(
            (EXTENT, *goal, NEAR, ALIGNED, terminate_on_success, *HALF_EDGES, AHEAD, WHEELBASE, STEERING, ACCELERATION,
             SLOWEST, FASTEST, SECONDS, PARTS),
            extent=EXTENT, obstacles=obstacles, speeds=[(SLOWEST, FASTEST)], half_edges=HALF_EDGES, ahead=AHEAD,
            start=start, goal=(float(goal[0]), float(goal[1]), NEAR), max_episode_steps=EPISODE_STEPS,
            render_mode=render_mode)
        self._checked("goal", [*goal, 0.0])

    def goal_distance(self, states: Array) -> Array:
        """Return the larger of distance and turn to the goal [B] of states [B, 4], in their tolerances."""
        return car_kernels.goal_distances(self.settings, np.ascontiguousarray(states, dtype=np.float64))
