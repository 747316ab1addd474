"""What the adapters have in common: identity, bounds and features of an environment."""

from typing import Any, cast

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, NotResettable
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.bounds import widened
from pbcs_ompl.resettable.fresh import EnvMaker, spec_of
from pbcs_ompl.resettable.sampling import check_radius, draw_valid, roll_near, uniform_in_ball

DEFAULT_EPISODE_STEPS = 1000


class Model:
    """The half of a `ResettableModel` that does not depend on how states are restored.

    Args:
        env: The environment without wrappers.
        offers: Its optional attributes.
        state_low, state_high: Finite bounds of the state [D].
    """

    def __init__(self, env: Any, offers: EnvAttributes, state_low: Array, state_high: Array):
        self.env = env
        self._offers = offers
        self.spec = spec_of(env)
        self.make_env: EnvMaker | None = None
        self.episode_limit: int | None = None
        self.state_low, self.state_high = _bounds(env, state_low, state_high)
        self.actions = ActionMap.of(env.action_space)
        self.action_low, self.action_high = self.actions.low, self.actions.high
        size = len(self.state_low)
        self._dims = list(range(size)) if offers.feature_dims is None else [int(dim) for dim in offers.feature_dims]
        self.feature_dims: tuple[int, ...] | None = tuple(self._dims)
        if not self._dims or not all(0 <= dim < size for dim in self._dims):
            raise NotResettable(f"{self.spec.id}: feature_dims={self._dims}, but the state has {size}")
        self.feature_low, self.feature_high = self.state_low[self._dims], self.state_high[self._dims]
        extent = self.feature_high - self.feature_low
        self.bin_size: Array = np.asarray(extent / 20.0 if offers.bin_size is None else offers.bin_size, np.float64)
        self.feature_periods = _periods(offers.feature_periods, self._dims)
        self.observation_size = int(env.observation_space.shape[0])
        self.max_episode_steps = int(offers.max_episode_steps or DEFAULT_EPISODE_STEPS)
        self.parallel_batch = int(offers.parallel_batch or 1)
        self.walls: Array = np.asarray(np.empty((0, 4)) if offers.walls is None else offers.walls, np.float64)
        self.goal_circle = offers.goal_circle

    def initial_state(self, seed: int | None = None) -> Array:
        """Return the state [D] after `env.reset`; seed and options of the spec, where it has some, come first."""
        self.env.reset(seed=self.spec.reset_seed(seed), options=self.spec.reset_options)
        return np.array(self.env.get_env_state(), dtype=np.float64)

    def feature(self, states: Array) -> Array:
        """Return the features [B, F] of states [B, D]: a copy of the feature dimensions."""
        return np.asarray(states).take(self._dims, axis=1)

    def distance(self, states: Array, others: Array) -> Array:
        """Return the distances [B] between states [B, D] and others [B, D] or [D]: the environment's, else Euclid's."""
        if self._offers.distance is not None:
            return self._offers.distance(states, others)
        lengths: Array = np.linalg.norm(np.asarray(states) - others, axis=1)
        return lengths

    def perturb(self, state: Array, radius: float, count: int, rng: np.random.Generator, *,
                reject_invalid: bool = True, before: Array | None = None, rollout_steps: int = 5,
                counter: Counter | None = None) -> Array:
        """Draw states [count, D] near a state: the environment's way, from the ball, or by rollouts that end in it.

        Invalid states are drawn again; a state that a rollout reaches is valid.

        Args:
            state: [D].
            radius: The largest distance.
            count: How many.
            rng: The random numbers.
            reject_invalid: Draw invalid states again.
            before: States [N, D] that lead to `state`: rollouts begin there as well.
            rollout_steps: The most steps of a rollout.
            counter: Where the steps of rollouts are counted.

        Raises:
            InvalidOption: the radius is negative or not finite.
            InvalidState: no valid state was found near `state`.
        """
        check_radius(radius)
        centre = np.asarray(state, dtype=np.float64)
        if self._offers.perturb_by_rollouts:
            return roll_near(cast(ResettableModel, self), centre, radius, count, rng, before=before,
                             rollout_steps=rollout_steps, counter=counter)
        draw = self._offers.perturb or uniform_in_ball
        return draw_valid(lambda number: draw(centre, radius, number, rng), count,
                          self.is_valid if reject_invalid else None, f"{radius:g} of {centre.tolist()}")

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] are finite and within the bounds [B]."""
        states = np.asarray(states, dtype=np.float64)
        inside: BoolArray = np.logical_and.reduce((states >= self.state_low) & (states <= self.state_high), axis=1)
        return inside

    def advance_towards(self, states: Array, targets: Array) -> Array:
        """Return controls [B, A] that lead from states [B, D] towards targets [B, F].

        Raises:
            InvalidOption: the environment offers no steering.
        """
        if self._offers.advance_towards is None:
            raise InvalidOption(f"{self.spec.id} cannot be steered: it has no `advance_towards(states, "
                                f"targets)`; choose another planner")
        return self._offers.advance_towards(states, targets)


def _periods(given: Array | None, dims: list[int]) -> Array:
    """Return the period of each feature [F], 0 for none."""
    if given is None:
        return np.zeros(len(dims))
    periods = np.asarray(given, dtype=np.float64)
    if periods.shape != (len(dims),) or not (np.isfinite(periods) & (periods >= 0.0)).all():
        raise InvalidOption(f"feature_periods={periods.tolist()}: expected a period, or 0, for each of the {len(dims)} "
                            f"features")
    return periods


def _bounds(env: Any, low: Array, high: Array) -> tuple[Array, Array]:
    low, high = widened(low, -np.inf), widened(high, np.inf)
    if low.ndim == 1 and low.shape == high.shape and np.isfinite(high - low).all() and (low < high).all():
        return low, high
    raise NotResettable(f"{type(env).__name__}: state_low and state_high must be finite vectors of one "
                        f"length, low < high; got {low.tolist()} and {high.tolist()}")
