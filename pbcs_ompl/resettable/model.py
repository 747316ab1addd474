"""What the adapters have in common: identity, bounds and features of an environment."""

from collections.abc import Callable
from typing import Any, cast

import numpy as np

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, NotResettable
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter
from pbcs_ompl.resettable.ball import valid_in_ball
from pbcs_ompl.resettable.rollouts import reached_in_ball

DEFAULT_EPISODE_STEPS = 1000


class Model:
    """The half of a `ResettableModel` that does not depend on how states are restored.

    Reads the optional attributes of an environment: `feature_dims` (default: all dimensions), `bin_size`
    (extent / 20), `walls` (none), `goal_circle` (none), `max_episode_steps` (that of its spec, else 1000),
    `parallel_batch` (1), `advance_towards` (none), `distance(states, others)` (Euclid's), and `perturb_by_rollouts`
    (False): whether states near a state are those that short random rollouts reach, because others may be no states
    at all.

    Args:
        env: The environment without wrappers. One that was not made by `gymnasium.make` has no id; its
            class's name stands in, from which it cannot be made again.
        state_low, state_high: Finite bounds of the state [D].
    """

    def __init__(self, env: Any, state_low: Array, state_high: Array):
        self.env = env
        spec = env.spec
        kwargs = {} if spec is None else {key: value for key, value in spec.kwargs.items() if key != "render_mode"}
        self.spec = EnvSpec(type(env).__qualname__ if spec is None else spec.id, kwargs,
                            getattr(env, "goal_rule", None), getattr(env, "feature_rule", None))
        self.state_low, self.state_high = _bounds(env, state_low, state_high)
        self.action_low = env.action_space.low.astype(np.float64)
        self.action_high = env.action_space.high.astype(np.float64)
        size = len(self.state_low)
        self._dims = [int(d) for d in getattr(env, "feature_dims", range(size))]
        self.feature_dims: tuple[int, ...] | None = tuple(self._dims)
        if not self._dims or not all(0 <= d < size for d in self._dims):
            raise NotResettable(f"{self.spec.id}: feature_dims={self._dims}, but the state has {size}")
        self.feature_low, self.feature_high = self.state_low[self._dims], self.state_high[self._dims]
        extent = self.feature_high - self.feature_low
        self.bin_size = np.asarray(getattr(env, "bin_size", extent / 20.0), dtype=np.float64)
        self.observation_size = int(env.observation_space.shape[0])
        limit = (None if spec is None else spec.max_episode_steps) or DEFAULT_EPISODE_STEPS
        self.max_episode_steps = int(getattr(env, "max_episode_steps", limit))
        self.parallel_batch = int(getattr(env, "parallel_batch", 1))
        self.walls = np.asarray(getattr(env, "walls", np.empty((0, 4))), dtype=np.float64)
        self.goal_circle: tuple[float, float, float] | None = getattr(env, "goal_circle", None)
        self._steer = getattr(env, "advance_towards", None)
        self._distance: Callable[[Array, Array], Array] | None = getattr(env, "distance", None)
        self._by_rollouts = bool(getattr(env, "perturb_by_rollouts", False))

    def initial_state(self, seed: int | None = None) -> Array:
        """Return the state [D] after `env.reset(seed=seed)`; the seed of the spec, where it has one, comes first."""
        start_seed = self.spec.start_seed
        self.env.reset(seed=seed if start_seed is None else start_seed)
        return np.array(self.env.get_env_state(), dtype=np.float64)

    def feature(self, states: Array) -> Array:
        """Return the features [B, F] of states [B, D]: a copy of the feature dimensions."""
        return np.asarray(states).take(self._dims, axis=1)

    def distance(self, states: Array, others: Array) -> Array:
        """Return the distances [B] between states [B, D] and others [B, D] or [D]: the environment's, else Euclid's."""
        if self._distance is not None:
            return self._distance(states, others)
        return np.linalg.norm(np.asarray(states) - others, axis=1)

    def perturb(self, state: Array, radius: float, count: int, rng: np.random.Generator, *,
                reject_invalid: bool = True, before: Array | None = None, rollout_steps: int = 5,
                counter: Counter | None = None) -> Array:
        """Draw states [count, D] around `state` [D]: uniformly from the ball, or by random rollouts that end in it.

        Invalid states are drawn again; what a rollout reaches is valid.

        Args:
            before: States [N, D] that lead to `state`: rollouts begin there as well.
            rollout_steps: The most steps of a rollout.
            counter: Where the steps of rollouts are counted.

        Raises:
            InvalidOption: the radius is negative or not finite.
            InvalidState: no valid state was found near `state`.
        """
        if self._by_rollouts:
            model = cast(ResettableModel, self)
            return reached_in_ball(model, np.asarray(state, dtype=np.float64), radius, count, rng, before=before,
                                   rollout_steps=rollout_steps, counter=counter)
        return valid_in_ball(state, radius, count, rng, self.is_valid if reject_invalid else None)

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are finite and within the bounds [B]."""
        states = np.asarray(states, dtype=np.float64)
        return np.logical_and.reduce((states >= self.state_low) & (states <= self.state_high), axis=1)

    def advance_towards(self, states: Array, targets: Array) -> Array:
        """Return controls [B, A] that lead from states [B, D] towards targets [B, F].

        Raises:
            InvalidOption: the environment offers no steering.
        """
        if self._steer is None:
            raise InvalidOption(f"{self.spec.id} cannot be steered: it has no `advance_towards(states, "
                                f"targets)`; choose another planner")
        return self._steer(states, targets)


def _bounds(env: Any, low: Array, high: Array) -> tuple[Array, Array]:
    low, high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    if low.ndim == 1 and low.shape == high.shape and np.isfinite(high - low).all() and (low < high).all():
        return low, high
    raise NotResettable(f"{type(env).__name__}: state_low and state_high must be finite vectors of one "
                          f"length, low < high; got {low.tolist()} and {high.tolist()}")
