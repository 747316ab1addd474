"""A cheetah that is rewarded for running fast only ([Matheron2020] 6.7): `pbcs/SparseHalfCheetah-v0`."""

from pathlib import Path

import gymnasium
import mujoco
import numpy as np
from gymnasium.spaces import Box

from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.envs.mujoco_env import FAR, FAST, BatchedMujocoEnv

CHEETAH = Path(gymnasium.__file__).parent / "envs/mujoco/assets/half_cheetah.xml"
FAST_ENOUGH = 2.0
"""Speed along x in m/s above which a step is rewarded."""
REWARD = 2.0
X, X_SPEED = 1, 10
"""Where the state [time | qpos 9 | qvel 9] has the position and the speed of the torso along x."""


class SparseHalfCheetahEnv(BatchedMujocoEnv):
    """Gymnasium's cheetah with a step reward of 2 when it runs faster than 2 m/s, no control cost, and no end.

    As in Gymnasium, the speed that is rewarded is the mean over the step, and the observation [17] leaves the position
    out. For planners a success is a state whose own speed is above 2 m/s, and the feature is (x, speed along x).

    Args:
        reset_noise: See `BatchedMujocoEnv`; 0.1 as in Gymnasium.
        threads: Threads for batches; None for one on each core.
        render_mode: "rgb_array" or None.
    """

    feature_dims = (X, X_SPEED)
    goal_threshold = 1.0
    max_episode_steps = 1000
    camera = "track"

    def __init__(self, *, reset_noise: float = 0.1, threads: int | None = None, render_mode: str | None = None):
        super().__init__(cheetah(), frame_skip=5, reset_noise=reset_noise, threads=threads, render_mode=render_mode)
        self.bin_size = np.array([0.5, 0.25])
        self.state_low[X], self.state_high[X] = -20.0, 20.0
        self.state_low[X_SPEED], self.state_high[X_SPEED] = -20.0, 20.0
        whole = np.concatenate([np.full(8, FAR), np.full(9, FAST)])
        self.observation_space = Box(-whole, whole, dtype=np.float64)

    def outcome(self, before: Array, after: Array) -> tuple[Array, BoolArray, BoolArray]:
        """Return the rewards [B], no end, and which states are fast."""
        speed = (after[:, X] - before[:, X]) / self.step_seconds
        rewards = np.where(speed > FAST_ENOUGH, REWARD, 0.0)
        return rewards, np.zeros(len(after), dtype=np.bool_), self.goal_distance(after) < self.goal_threshold

    def observe(self, states: Array) -> Array:
        """Return [qpos without x | qvel] [B, 17]."""
        return np.array(states, dtype=np.float64)[:, 2:]

    def goal_distance(self, states: Array) -> Array:
        """Return how much speed is missing to 3 m/s [B], at least 0: less than 1 is a success."""
        return np.maximum(0.0, FAST_ENOUGH + self.goal_threshold - np.asarray(states)[:, X_SPEED])


def cheetah() -> "mujoco.MjModel":
    """Return Gymnasium's model; its deprecated way to say how heavy it is makes MuJoCo write a log file."""
    spec = mujoco.MjSpec.from_file(str(CHEETAH))
    mass = spec.compiler.settotalmass
    spec.compiler.settotalmass = -1.0
    model = spec.compile()
    mujoco.mj_setTotalmass(model, mass)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model
