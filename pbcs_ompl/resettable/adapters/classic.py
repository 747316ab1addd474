"""Adapters for environments that keep all of their state in one place: classic control, and `get_env_state`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.memory.exploration import SEEDS, Changes, episodes, plain_copies
from pbcs_ompl.resettable.memory.memory import Memory
from pbcs_ompl.resettable.rules import FeatureRule, feature_rule
from pbcs_ompl.resettable.task_env import bare

ANGLES = {"PendulumEnv": (0,), "AcrobotEnv": (0, 1)}
"""Which numbers of a state are angles that turn freely; CartPole's ends the episode before it has turned."""
TUPLE = 1.0
"""Stands for the width where the state is a tuple of numbers."""


class AttributeEnv(RestorableEnv):
    """An environment whose state is its attribute `state`, as in Gymnasium's classic control.

    MountainCarContinuous resets to float64 and steps in float32: the width of the numbers is saved with them.
    """

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        before = plain_copies(inner)
        inner.reset(seed=SEEDS[0])
        changes = Changes(inner)
        for event in episodes(inner):
            changes.add(event)
        self._memory = Memory(inner, changes, before, besides=("state",))
        super().__init__(inner, goal, feature)

    def attach(self) -> None:
        """Let the memory refer to `inner`."""
        self._memory = self._memory.of(self.inner)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Reset the environment as if nothing had run in it before."""
        self._memory.clear()
        return super().reset(seed=seed, options=options)

    def default_feature(self) -> FeatureRule:
        """Return the whole of the state."""
        return feature_rule(self.usual_rule())

    def usual_rule(self) -> str:
        """Return the whole of the state."""
        return "state"

    def angles(self) -> tuple[str, int, Sequence[int]]:
        """Return the angles of a pendulum."""
        return "state", len(self.inner.state), ANGLES.get(type(bare(self.inner)).__name__, ())

    def save(self) -> Array:
        """Return the other attributes that change, the numbers of the state, and their width in bytes."""
        state = self.inner.state
        width = state.dtype.itemsize if isinstance(state, np.ndarray) else TUPLE
        return np.array([*self._memory.save(), *state, width], dtype=np.float64)

    def load(self, saved: Array) -> None:
        """Go back to what `save` returned."""
        numbers, width = saved[self._memory.size:-1], saved[-1]
        if width not in (4.0, 8.0, TUPLE):
            raise InvalidState(f"the state says that its numbers have {width} bytes; expected 4 or 8")
        self._memory.load(saved[:self._memory.size])
        array = numbers.astype(np.float32 if width == 4.0 else np.float64)
        self.inner.state = tuple(array.tolist()) if width == TUPLE else array

    def check_constants(self) -> None:
        """Refuse an environment of which something else has changed than what is saved."""
        self._memory.check_constants()

    def named_state(self, env: Any) -> dict[str, Any]:
        """Return the parts of the state of an environment of this class, by name."""
        return {"state": env.state, **self._memory.values(env)}

    def observation(self) -> Any:
        """Return the environment's own observation, else the state."""
        observe = getattr(self.inner, "_get_obs", getattr(self.inner, "_get_ob", None))  # the latter is Acrobot's
        return np.asarray(self.inner.state, bare(self.inner).observation_space.dtype) if observe is None else observe()


def has_state_attribute(env: Any) -> bool:
    """Return whether `env` is one of Gymnasium's classic control environments with a vector `state`; resets it."""
    if not type(bare(env)).__module__.startswith("gymnasium.envs.classic_control"):
        return False
    env.reset(seed=0)
    return isinstance(getattr(env, "state", None), np.ndarray | tuple)


class VectorEnv(RestorableEnv):
    """An environment with `get_env_state`, `set_env_state` and `observe`, to which a goal or feature is given."""

    def default_feature(self) -> FeatureRule:
        """Return what the environment itself calls its feature, else all of its state."""
        offered = EnvAttributes.of(self.inner).feature_dims
        dims = list(range(len(self.inner.get_env_state())) if offered is None else offered)
        return lambda outcome: np.asarray(outcome.env.get_env_state())[dims]

    def save(self) -> Array:
        """Return the environment's own state."""
        return np.array(self.inner.get_env_state(), dtype=np.float64)

    def load(self, saved: Array) -> None:
        """Go back to a state of the environment."""
        self.inner.set_env_state(saved.copy())

    def named_state(self, env: Any) -> dict[str, Any]:
        """Return the environment's own state."""
        return {"get_env_state()": env.get_env_state()}

    def observation(self) -> Any:
        """Return the environment's observation, its state where it has no `observe`."""
        state = self.save()
        observe = EnvAttributes.of(self.inner).observe
        return state if observe is None else observe(state[None])[0]
