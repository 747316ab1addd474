"""Gymnasium's ant and D4RL's, and what is symmetric about them: turned by a quarter, an ant is another ant."""

from pathlib import Path

import gymnasium
import mujoco
import numpy as np

from pbcs_ompl.core.robot import Symmetry
from pbcs_ompl.core.types import Array
from pbcs_ompl.envs.free_robot import FreeRobot

XML = Path(gymnasium.__file__).parent / "envs/mujoco/assets/ant.xml"
FRAME_SKIP = 5
"""Of both ants."""
D4RL_TIMESTEP, D4RL_CONTROL, D4RL_GEAR = 0.02, 30.0, 1.0
"""What `d4rl/locomotion/assets/ant.xml` has instead of 0.01 s, 1 and 150: a fifth of the torque, ten steps a second."""
POSITIONS, LEGS = 15, 4
ANKLES = np.array([1.0, -1.0, -1.0, 1.0])
"""The signs of the ankles' axes, leg by leg as they stand around the torso."""
MOTORS = np.array([3, 0, 1, 2])
"""The leg of each pair of motors (hip, ankle)."""


def ant_spec(kind: str) -> "mujoco.MjSpec":
    """Return the model of an ant, "gymnasium" or "d4rl", to which a world can be added."""
    spec = mujoco.MjSpec.from_file(str(XML))
    if kind == "d4rl":
        spec.option.timestep = D4RL_TIMESTEP
        for motor in spec.actuators:
            motor.ctrlrange = [-D4RL_CONTROL, D4RL_CONTROL]
            gear = np.array(motor.gear)
            gear[0] = D4RL_GEAR
            motor.gear = gear
    return spec


def ant_robot() -> FreeRobot:
    """Return what is known of an ant: four ways to see it, the k-th with leg k in front."""
    return FreeRobot(POSITIONS, tuple(_quarter_turns(count) for count in range(LEGS)))


def _quarter_turns(count: int) -> Symmetry:
    """Return how an ant is seen whose root frame is turned by quarters: its legs change places."""
    angle = count * np.pi / 2
    signs = np.stack([np.ones(LEGS), ANKLES], axis=1)
    legs = (np.arange(LEGS) + count) % LEGS
    factors = (signs * signs[legs]).ravel()
    joints = np.zeros((2 * LEGS, 2 * LEGS))
    joints[np.arange(2 * LEGS), (2 * legs[:, None] + np.arange(2)).ravel()] = factors
    whole = np.eye(2 * POSITIONS - 1)
    whole[3:7, 3:7] = _right_product(angle)
    whole[7:15, 7:15] = whole[21:29, 21:29] = joints
    c, s = np.cos(angle), np.sin(angle)
    whole[18:20, 18:20] = [[c, s], [-s, c]]
    order = (2 * MOTORS[:, None] + np.arange(2)).ravel()
    return Symmetry(whole, joints[np.ix_(order, order)])


def _right_product(angle: float) -> Array:
    """Return the matrix of q -> q r for the quaternion r of a turn about the z axis."""
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    return np.array([[c, 0.0, 0.0, -s], [0.0, c, s, 0.0], [0.0, -s, c, 0.0], [s, 0.0, 0.0, c]])
