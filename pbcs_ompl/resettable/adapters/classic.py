"""Adapters for environments that keep all of their state in one place: classic control, and `get_env_state`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.success_flag import as_vector
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.memory.exploration import SEEDS, Changes, episodes, plain_copies
from pbcs_ompl.resettable.memory.memory import Memory
from pbcs_ompl.resettable.observations import has_goals
from pbcs_ompl.resettable.observing import state_observer
from pbcs_ompl.resettable.rules import FeatureRule, Outcome, feature_rule, granted_success, selected_dims
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
    """An environment with `get_env_state` and `set_env_state` of which something is given, or not known.

    A goal or feature is given to it, or it declares no bounds, or nothing says what is observed in a state: the last
    observation is then kept as a part of the state.
    """

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        self._offers = EnvAttributes.of(inner)
        self._observe = state_observer(inner, self._offers)
        inner.reset(seed=0)
        self._size = len(as_vector(inner, inner.get_env_state()))
        self._observed: Array = np.empty(0)
        if feature is None:  # what the environment declares fits its own choice
            self.walls, self.goal_circle, self.bin_size = (self._offers.walls, self._offers.goal_circle,
                                                           self._offers.bin_size)
        self.max_episode_steps = self._offers.max_episode_steps
        super().__init__(inner, goal, feature)

    def default_feature(self) -> FeatureRule:
        """Return what the environment itself calls its feature, else its achieved goal, else all of its state."""
        dims = self._declared_dims
        if self._offers.feature_dims is None and has_goals(self.inner):
            return feature_rule("achieved_goal")
        return lambda outcome: np.asarray(outcome.env.get_env_state())[dims]

    def feature_box(self) -> tuple[Array, Array] | None:
        """Return the bounds [F] that the environment declares of the numbers of its state that are the feature."""
        low, high, dims = self._offers.state_low, self._offers.state_high, self._dims
        if low is None or high is None or dims is None:
            return None
        return np.asarray(low, np.float64)[dims], np.asarray(high, np.float64)[dims]

    def _periods(self) -> Array:
        declared, dims = self._offers.feature_periods, self._dims
        periods = {} if declared is None else dict(zip(self._declared_dims, declared, strict=False))
        return np.array([periods.get(dim, 0.0) for dim in dims or [-1] * len(self._head)])

    @property
    def _dims(self) -> list[int] | None:
        """Which numbers of the environment's state are the feature; None if it is something else."""
        if self.feature_rule is None:
            return None if self._offers.feature_dims is None and has_goals(self.inner) else self._declared_dims
        chosen = selected_dims(self.feature_rule, "state", self._size)
        return None if chosen is None else list(chosen)

    @property
    def _declared_dims(self) -> list[int]:
        offered = self._offers.feature_dims
        return list(range(self._size)) if offered is None else [int(dim) for dim in offered]

    def is_success(self, outcome: Outcome) -> bool:
        """Return whether an outcome is a success: by the goal that was given, else as the environment grants it."""
        return granted_success(outcome) if self.goal_rule is None else super().is_success(outcome)

    @property
    def goal_is_unknown(self) -> bool:
        """Whether the goal is unknown: no distance to it is declared either."""
        return super().goal_is_unknown and self._offers.goal_distance is None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Reset the environment, and keep what is observed."""
        outcome = super().reset(seed=seed, options=options)
        self._observed = outcome[0]
        return outcome

    def step(self, action: Array) -> Any:
        """Make one step, and keep what is observed."""
        outcome = super().step(action)
        self._observed = outcome[0]
        return outcome

    def save(self) -> Array:
        """Return the environment's own state, and what is observed in it where nothing else says that."""
        state = as_vector(self.inner, self.inner.get_env_state())
        return state if self._observe is not None else np.concatenate([state, self._observed])

    def load(self, saved: Array) -> None:
        """Go back to a state of the environment."""
        self._observed = saved[self._size:].copy()
        self.inner.set_env_state(saved[:self._size].copy())

    def named_state(self, env: Any) -> dict[str, Any]:
        """Return the environment's own state."""
        return {"get_env_state()": env.get_env_state()}

    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] of states [B, D]."""
        features = len(self.feature_dims)
        saved = np.array(states, dtype=np.float64)[:, features:-1]
        return saved[:, self._size:] if self._observe is None else self._observe(saved)

    def observation(self) -> Any:
        """Return what was kept; `observe` makes no use of it."""
        return self._observed
