"""Bounds in float32 mean what they were rounded from, and observations in float32 are still the state."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.resettable import adapt
from pbcs_ompl.resettable.bounds import widened


@given(st.floats(-1e30, 1e30))
def test_a_number_is_within_its_own_rounded_value(value: float) -> None:
    low, high = widened(np.float32([value]), -np.inf)[0], widened(np.float32([value]), np.inf)[0]
    assert low <= value <= high
    assert np.float32(low) in (np.float32(value), np.nextafter(np.float32(value), np.float32(-np.inf)))


@given(st.floats(-1e30, 1e30))
def test_widening_twice_is_widening_once(value: float) -> None:
    for direction in (-np.inf, np.inf):
        once = widened(np.float32([value]), direction)
        assert widened(once, direction).tolist() == once.tolist()


def test_bounds_that_are_exact_stay() -> None:
    exact = [-1.0, 0.0, 0.5, 0.7, np.pi, 1e9, np.inf]
    assert widened(exact, np.inf).tolist() == exact
    assert widened([1, 2], -np.inf).tolist() == [1.0, 2.0]
    assert widened(np.float32([0.7]).astype(np.float64), np.inf)[0] >= 0.7


class Edge(gymnasium.Env[Any, Any]):
    """The state is in float64, the observation the same numbers in another type; it begins on the bound."""

    action_space = spaces.Box(-0.1, 0.1, (2,), np.float32)

    def __init__(self, kind: Any = np.float32, bound: float = 0.7, scale: float = 1.0):
        self.kind, self.bound, self.scale = kind, bound, scale
        self.observation_space = spaces.Box(-bound, bound, (2,), kind)

    def _seen(self) -> Any:
        return (self.scale * self.p).astype(self.kind)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.p = np.array([self.bound, 0.0 if self.scale != 1.0 else 0.1])
        return self._seen(), {}

    def step(self, action: Any) -> Any:
        self.p = np.clip(self.p + action, -self.bound, self.bound)
        won = bool((self.p < -0.5).all())
        return self._seen(), float(won), won, False, {"is_success": won}

    def get_env_state(self) -> Any:
        return self.p.copy()

    def set_env_state(self, state: Any) -> None:
        self.p = np.array(state)


class Declared(Edge):
    state_low = property(lambda self: self.observation_space.low)
    state_high = property(lambda self: self.observation_space.high)

    def observe(self, states: Any) -> Any:
        return states


class Distant(Declared):
    goal_threshold = 0.1

    def goal_distance(self, states: Any) -> Any:
        return np.linalg.norm(states + 0.5, axis=1)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64])
@pytest.mark.parametrize("bound", [0.7, 0.1, 2.0 * np.pi / 3.0, 1.0, 8.0])
@pytest.mark.parametrize("env", [Edge, Declared, Distant])
def test_a_start_on_the_bound_is_inside(env: type[Edge], bound: float, kind: Any) -> None:
    model = adapt(env(kind, bound))
    start = model.initial_state(0)
    assert (model.state_low <= start).all()
    assert (start <= model.state_high).all()
    assert model.is_valid(start[None]).tolist() == [True]


def test_the_model_observes_what_the_environment_returns() -> None:
    env = Edge()
    observation, _ = env.reset(seed=0)
    model = adapt(Edge())
    np.testing.assert_array_equal(model.observe(model.initial_state(0)[None])[0], observation)


def test_an_observation_that_is_the_state_in_the_reset_only_is_not_the_state() -> None:
    class Falling(Edge):
        def reset(self, **options: Any) -> Any:
            super().reset(**options)
            self.p = np.zeros(2)
            return self._seen(), {}

    env = Falling(scale=2.0)
    observation, _ = env.reset(seed=0)
    model = adapt(Falling(scale=2.0))
    assert len(model.initial_state(0)) > 3  # what was observed is a part of it
    np.testing.assert_array_equal(model.observe(model.initial_state(0)[None])[0], observation)
