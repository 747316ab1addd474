"""Adapters for environments that keep all of their state in one place: classic control, and `get_env_state`."""

from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.rules import FeatureRule, feature_rule


class AttributeEnv(RestorableEnv):
    """An environment whose state is its attribute `state`, as in Gymnasium's classic control.

    MountainCarContinuous resets to float64 and steps in float32: the width of the numbers is saved with them.
    """

    def default_feature(self) -> FeatureRule:
        """Return the whole of the state."""
        return feature_rule("state")

    def save(self) -> Array:
        """Return the numbers of the state and their width in bytes."""
        state = self.inner.state
        return np.array([*state, state.dtype.itemsize], dtype=np.float64)

    def load(self, saved: Array) -> None:
        """Go back to what `save` returned."""
        if saved[-1] not in (4.0, 8.0):
            raise InvalidState(f"the state says that its numbers have {saved[-1]} bytes; expected 4 or 8")
        self.inner.state = saved[:-1].astype(np.float32 if saved[-1] == 4.0 else np.float64)

    def observation(self) -> Any:
        """Return the environment's own observation, else the state."""
        observe = getattr(self.inner, "_get_obs", None)
        return self.inner.state if observe is None else observe()


def has_state_attribute(env: Any) -> bool:
    """Return whether `env` is one of Gymnasium's classic control environments with a vector `state`; resets it."""
    if not type(env).__module__.startswith("gymnasium.envs.classic_control"):
        return False
    env.reset(seed=0)
    return isinstance(getattr(env, "state", None), np.ndarray)


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

    def observation(self) -> Any:
        """Return the environment's observation, its state where it has no `observe`."""
        state = self.save()
        observe = EnvAttributes.of(self.inner).observe
        return state if observe is None else observe(state[None])[0]
