"""MuJoCo's model and data within an environment, and which of its results the environment keeps up to date."""

from importlib import import_module
from typing import Any

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.resettable.task_env import bare

DM_CONTROL = "dm_control.rl.control"
"""The module of the environments of dm_control's suite."""
COMPOSER = "dm_control.composer.environment"
"""That of the others, whose model each reset compiles."""


class Simulation:
    """The simulation of an environment of Gymnasium or gymnasium-robotics: its attributes `model` and `data`.

    After a step, bodies are where MuJoCo had them before the last of its own steps, and steps and observations may read
    that: `complete` does not bring it back, so it is saved (see `adapters.mujoco_probe`).
    """

    def __init__(self, env: Any):
        import mujoco

        self.env = env
        self._mujoco: Any = mujoco  # its functions have no types
        self._bare = bare(env)

    @property
    def model(self) -> Any:
        """The `MjModel`."""
        return self._bare.model

    @property
    def data(self) -> Any:
        """The `MjData`."""
        return self._bare.data

    def complete(self) -> None:
        """Compute of a restored state what is not saved and may be looked at: where bodies are."""
        self._mujoco.mj_kinematics(self.model, self.data)
        self._mujoco.mj_comPos(self.model, self.data)

    def refresh(self) -> None:
        """Compute what the environment itself computes again after each step: nothing."""

    def forward(self) -> None:
        """Compute all that an observation may read; it changes the warm start."""
        self._mujoco.mj_forward(self.model, self.data)
        self._mujoco.mj_rnePostConstraint(self.model, self.data)

    def check_observed(self) -> None:
        """Refuse an environment whose observation cannot be asked for.

        Raises:
            NotResettable: there is no `_get_obs`.
        """
        if not callable(getattr(self._bare, "_get_obs", None)):
            raise NotResettable(f"{type(self._bare).__name__} has no `_get_obs()`, so a restored state cannot be "
                                f"observed; add it, or get_env_state and set_env_state")

    def observed(self) -> Any:
        """Return the observation; of a maze of gymnasium-robotics, with that of the agent in it."""
        env = self._bare
        agent = next((getattr(env, name) for name in ("point_env", "ant_env") if hasattr(env, name)), None)
        if agent is None:
            return env._get_obs()
        seen = agent._get_obs()
        return env._get_obs(seen[0] if isinstance(seen, tuple) else seen)


class DmControlSimulation(Simulation):
    """The simulation of an environment of dm_control's suite, which shimmy makes one of Gymnasium.

    dm_control computes all that follows from positions and speeds after each step (`legacy_step`), and begins the next
    step with it: a restored state has to have it as well.
    """

    @property
    def model(self) -> Any:
        """The `MjModel`."""
        return self._bare._env.physics.model.ptr

    @property
    def data(self) -> Any:
        """The `MjData`."""
        return self._bare._env.physics.data.ptr

    def complete(self) -> None:
        """Compute of a restored state what follows from positions and speeds."""
        self._mujoco.mj_step1(self.model, self.data)

    def refresh(self) -> None:
        """Compute what the environment itself computes again after each step."""
        if self._bare._env.physics.legacy_step:
            self.complete()

    def forward(self) -> None:
        """Compute nothing: observations are made of what is there after a step."""

    def check_observed(self) -> None:
        """Refuse nothing: every task observes."""

    def observed(self) -> Any:
        """Return the observation of the task."""
        inner = self._bare._env
        observation = inner.task.get_observation(inner.physics)
        return import_module(DM_CONTROL).flatten_observation(observation) if inner._flat_observation else observation


def simulation_of(env: Any) -> Simulation | None:
    """Return the simulation in `env`; None where there is none that stays the same when the environment is reset."""
    within = bare(env)
    if type(getattr(within, "model", None)).__name__ == "MjModel" and hasattr(within, "data"):
        return Simulation(env)
    if _is_a(getattr(within, "_env", None), DM_CONTROL):
        return DmControlSimulation(env)
    return None


def holds_compiled_model(env: Any) -> bool:
    """Return whether `env` is one of dm_control, a copy of which has a copy of the whole model."""
    within = getattr(bare(env), "_env", None)
    return _is_a(within, DM_CONTROL) or _is_a(within, COMPOSER)


def _is_a(env: Any, module: str) -> bool:
    return any(kind.__module__ == module for kind in type(env).__mro__)
