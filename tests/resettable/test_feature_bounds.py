"""The box that is explored: bounds that the environment declares win, goals lie inside, what never moves is said."""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from pbcs_ompl.cli.models import feature_words
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.resettable import adapt


class Pushed(gymnasium.Env[Any, Any]):
    """A hand in a box of known size pushes a ball that random steps do not reach; goals are drawn far away."""

    action_space = spaces.Box(-0.01, 0.01, (2,), np.float64)

    def __init__(self, goals: bool = True):
        self.goals = goals
        hand = spaces.Box(-2.0, 2.0, (2,), np.float32)
        ball = spaces.Box(-np.inf, np.inf, (2,), np.float64)
        self.observation_space = spaces.Dict(
            observation=hand, **({"achieved_goal": ball, "desired_goal": ball} if goals else {}))

    def _seen(self) -> Any:
        goals = {"achieved_goal": self.ball.copy(), "desired_goal": self.goal.copy()} if self.goals else {}
        return {"observation": self.hand.astype(np.float32), **goals}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.hand, self.ball = np.zeros(2), np.ones(2)
        self.goal = np.array([self.np_random.uniform(3.0, 5.0), 1.0])
        return self._seen(), {"is_success": False}

    def step(self, action: Any) -> Any:
        self.hand = np.clip(self.hand + action, -2.0, 2.0)
        self.ball[0] += 0.1 * action[0]
        return self._seen(), 0.0, False, False, {"is_success": False}


def model_of(feature: str | None, *, goals: bool = True) -> ResettableModel:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return adapt(Pushed(goals), feature=feature)


@pytest.mark.parametrize(("feature", "goals", "low", "high"), [
    (None, False, [-2.0, -2.0], [2.0, 2.0]),
    ("obs", False, [-2.0, -2.0], [2.0, 2.0]),
    ("obs[-1]", False, [-2.0], [2.0]),
    ("obs[4:6]", True, [-2.0, -2.0], [2.0, 2.0]),
])
def test_finite_bounds_of_the_observation_win(feature: str | None, goals: bool, low: list[float],
                                              high: list[float]) -> None:
    model = model_of(feature, goals=goals)
    np.testing.assert_allclose(model.feature_low, low, atol=1e-6)
    np.testing.assert_allclose(model.feature_high, high, atol=1e-6)
    assert feature_words(model).endswith("from the observation space")


def test_what_has_no_bounds_is_explored_beside_what_has() -> None:
    model = model_of("obs[4],achieved_goal[0]")
    assert model.feature_high[0] == pytest.approx(2.0)
    assert model.feature_high[1] > 1.0
    assert "the observation space and 500 random steps, widened" in feature_words(model)


@pytest.mark.parametrize("feature", ["achieved_goal", None])
def test_goals_of_resets_lie_inside(feature: str | None) -> None:
    model, env = model_of(feature), Pushed()
    for seed in range(200):
        observation, _ = env.reset(seed=seed)
        goal = observation["desired_goal"]
        assert (model.feature_low < goal).all()
        assert (goal < model.feature_high).all()
    assert "and the goals of resets" in feature_words(model)


def test_a_dimension_that_never_moves_is_reported() -> None:
    with pytest.warns(UserWarning, match="random steps hardly move dimension 1 of the feature"):
        model = adapt(Pushed(), feature="achieved_goal")
    assert "hardly move dimension 1" in feature_words(model)


def test_starts_of_what_random_steps_do_not_touch_lie_inside() -> None:
    class Scattered(Pushed):
        def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
            super().reset(seed=seed)
            self.ball = self.np_random.uniform(-1.0, 1.0, 2)
            return self._seen(), {}

        def step(self, action: Any) -> Any:
            self.hand = np.clip(self.hand + action, -2.0, 2.0)
            return self._seen(), 0.0, False, False, {}

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = adapt(Scattered(), feature="obs[4:6],achieved_goal")
    for seed in range(50):
        place = Scattered().reset(seed=seed)[0]["achieved_goal"]
        assert (model.feature_low[2:] < place).all()
        assert (place < model.feature_high[2:]).all()


def test_what_moves_is_not_reported() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        adapt(gymnasium.make("Pendulum-v1"))
        adapt(Pushed(), feature="obs[4:6]")
