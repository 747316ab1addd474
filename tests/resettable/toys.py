"""Small environments, each with one thing that a restored state has to bring back."""

from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.resettable import adapt

BOX = gymnasium.spaces.Box(-np.inf, np.inf, (1,), np.float64)
PUSH = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float64)
XML = """<mujoco><option timestep="0.01"/><worldbody><body name="b"><joint name="x" type="slide" axis="1 0 0"
damping="2"/><geom name="g" size=".1" mass="1"/></body><body name="m" mocap="true" pos="0 0 1"><geom size=".05"
contype="0" conaffinity="0"/></body></worldbody><actuator><ACTUATOR joint="x" OPTIONS/></actuator></mujoco>"""


class Line(gymnasium.Env):
    """A point on a line, copyable; subclasses say what an action does."""

    action_space, observation_space = PUSH, BOX

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.x = 0.0
        self.begin()
        return np.array([self.x]), {}

    def step(self, action: Any) -> Any:
        self.x += self.push(float(action[0]))
        return np.array([self.x]), self.x, self.x > 5.0, False, {"is_success": self.x > 4.0}

    def begin(self) -> None:
        """Reset what a subclass has."""

    def push(self, action: float) -> float:
        """Return how far the point moves."""
        return 0.1 * action


class Cart(gymnasium.Env):
    """A cart of MuJoCo on a line; subclasses say what an action does."""

    action_space, observation_space = PUSH, gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    render_mode = None
    actuator = "motor", 'gear="5"'

    def __init__(self) -> None:
        import mujoco

        self.model = mujoco.MjModel.from_xml_string(XML.replace("ACTUATOR", self.actuator[0]).replace(
            "OPTIONS", self.actuator[1]))
        self.data = mujoco.MjData(self.model)

    def _get_obs(self) -> Any:
        return np.concatenate([self.data.qpos, self.data.qvel])

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        import mujoco

        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        self.begin()
        mujoco.mj_forward(self.model, self.data)
        return self._get_obs(), {}

    def step(self, action: Any) -> Any:
        import mujoco

        self.push(float(action[0]))
        mujoco.mj_step(self.model, self.data, 5)
        reward = self.reward()
        return self._get_obs(), reward, False, False, {"is_success": bool(self.data.qpos[0] > 5.0)}

    def begin(self) -> None:
        """Reset what a subclass has."""

    def push(self, action: float) -> None:
        """Set the controls."""
        self.data.ctrl[0] = action

    def reward(self) -> float:
        """Return the reward after a step."""
        return 0.0


def walk(kind: Any, steps: int, control: float) -> None:
    """Adapt an environment and make steps in it, each from the state before."""
    model = adapt(kind())
    state = model.initial_state(0)
    for _ in range(steps):
        state = model.transition(state[None], np.full((1, 1), control)).states[0]
