"""A tiny world for the bridge: a point in a square, with a wall and dimensions outside the feature."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from model_env import ModelEnv

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.types import Array, BoolArray, Counter, Transition


class Square:
    """A point at `feature_dims` of a state, in [0, 5]^2; the other dimensions count steps."""

    def __init__(self, size: int = 2, feature_dims: tuple[int, ...] | None = (0, 1), goal: float = 4.5,
                 radius: float = 0.5, start: tuple[float, float] = (0.5, 0.5)):
        self.spec = EnvSpec("square", {"size": size, "list": (1, 2)})
        self.env = None  # the model is the whole environment
        self.capabilities = frozenset({"visited", "arbitrary", "exact"})
        self.where = [0, 1] if feature_dims is None else list(feature_dims)
        self.state_low, self.state_high = np.zeros(size), np.full(size, 1e6)
        self.state_high[self.where] = 5.0
        self.action_low, self.action_high = np.full(2, -0.3), np.full(2, 0.3)
        self.feature_low, self.feature_high = np.zeros(2), np.full(2, 5.0)
        self.feature_dims, self.bin_size = feature_dims, np.full(2, 0.25)
        self.observation_size, self.goal_threshold, self.max_episode_steps = size, radius, 100
        self.parallel_batch, self.episode_limit, self.feature_periods = 1, None, np.zeros(2)
        self.walls, self.goal_circle = np.array([[2.0, 0.0, 2.2, 3.0]]), (goal, goal, radius)
        self.goal, self.start = np.array([goal, goal]), start

    def make_env(self) -> ModelEnv:
        return ModelEnv(self)

    def initial_state(self, seed: int | None = None) -> Array:
        state = np.zeros(len(self.state_low))
        state[self.where] = self.start
        return state

    def transition(self, states: Array, controls: Array) -> Transition:
        pairs = zip(states.tolist(), controls.tolist(), strict=True)
        following = np.array([self.step_one(state, control) for state, control in pairs])
        reached = self.goal_distance(following) < self.goal_threshold
        return Transition(following, reached.astype(float), reached, reached)

    def step_one(self, state: list[float], control: list[float]) -> list[float]:
        result = [value + 1 for value in state]
        for dim, move in zip(self.where, control, strict=True):
            result[dim] = min(max(state[dim] + move, 0.0), 5.0)
        x, y = (result[dim] for dim in self.where)
        if 2.0 <= x <= 2.2 and y <= 3.0:
            for dim in self.where:
                result[dim] = state[dim]
        return result

    def observe(self, states: Array) -> Array:
        return states

    def feature(self, states: Array) -> Array:
        return states[:, self.where]

    def goal_distance(self, states: Array) -> Array:
        return np.linalg.norm(self.feature(states) - self.goal, axis=1)

    def is_valid(self, states: Array) -> BoolArray:
        x, y = self.feature(states).T
        return ~((x >= 2.0) & (x <= 2.2) & (y <= 3.0))

    def distance(self, states: Array, others: Array) -> Array:
        return np.linalg.norm(self.feature(states) - np.atleast_2d(others)[:, self.where], axis=1)

    def perturb(self, state: Array, radius: float, count: int, rng: np.random.Generator, *,
                reject_invalid: bool = True, before: Array | None = None, rollout_steps: int = 5,
                counter: Counter | None = None) -> Array:
        return np.repeat(state[None], count, axis=0)

    def advance_towards(self, states: Array, targets: Array) -> Array:
        return np.clip(targets - self.feature(states), self.action_low, self.action_high)


@pytest.fixture
def square() -> Callable[..., Square]:
    """The class, to be built with the options a test needs."""
    return Square


LAYOUTS = [SimpleNamespace(size=2, feature_dims=(0, 1)), SimpleNamespace(size=3, feature_dims=(0, 1)),
           SimpleNamespace(size=5, feature_dims=(1, 2)), SimpleNamespace(size=5, feature_dims=(3, 1)),
           SimpleNamespace(size=4, feature_dims=None)]


@pytest.fixture(params=LAYOUTS, ids=lambda layout: f"{layout.size}-{layout.feature_dims}")
def any_square(request: pytest.FixtureRequest) -> Square:
    """The world with each way the feature can lie in the state."""
    return Square(size=request.param.size, feature_dims=request.param.feature_dims)
