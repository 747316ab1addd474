"""Environments with get_env_state, set_env_state and a step, and the faults that the check finds in them."""

import re
from typing import Any

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.core.errors import InvalidOption, InvalidState, Mismatch, NotResettable
from pbcs_ompl.resettable import adapt, check_resettable
from pbcs_ompl.skills.robots.worlds import robot_of


class Cart(gymnasium.Env):
    """Position and speed on a line; the observation is the position only."""

    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
    observation_space = gymnasium.spaces.Box(-10.0, 10.0, (1,), np.float64)
    state_low, state_high = np.array([-5.0, -1.0]), np.array([5.0, 1.0])
    feature_dims = (0,)

    def __init__(self) -> None:
        self.state = np.zeros(2)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.state = np.zeros(2)
        return self.state[:1].copy(), {}

    def step(self, action: Any) -> Any:
        speed = float(np.clip(self.state[1] + 0.1 * float(action[0]), -1.0, 1.0))
        self.state = np.array([np.clip(self.state[0] + 0.1 * speed, -5.0, 5.0), speed])
        done = bool(self.state[0] > 0.02)
        return self.state[:1].copy(), float(done), done, False, {"is_success": done}

    def get_env_state(self) -> np.ndarray:
        return self.state.copy()

    def set_env_state(self, state: np.ndarray) -> None:
        self.state = np.array(state)

    def observe(self, states: np.ndarray) -> np.ndarray:
        return np.array(states)[:, :1]


def test_a_cart_is_a_model() -> None:
    model = adapt(Cart())
    assert model.capabilities == {"visited", "arbitrary", "exact"}
    assert model.spec.id == "Cart"
    assert model.feature_dims == (0,)
    np.testing.assert_array_equal(model.bin_size, [0.5])
    states = np.array([[0.0, 0.5, 0.0], [-1.0, 0.0, 0.0]])
    result = model.transition(states, np.array([[1.0], [-1.0]]))
    np.testing.assert_allclose(result.states, [[0.06, 0.6, 1.0], [-1.01, -0.1, 0.0]])
    np.testing.assert_array_equal(result.success, [True, False])
    assert model.step_one([0.0, 0.5, 0.0], [1.0]) == result.states[0].tolist()
    np.testing.assert_array_equal(model.is_valid(np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [np.nan, 0.0, 0.0],
                                                           [0.0, 0.0, 1.5]])), [True, False, False, False])


def test_success_is_a_function_of_the_state() -> None:
    model, other = adapt(Cart()), adapt(Cart())
    states = np.array([[0.0, 0.5, 0.0], [0.0, -0.5, 0.0]])
    after = model.transition(states, np.ones((2, 1))).states
    np.testing.assert_array_equal(other.goal_distance(after) < other.goal_threshold, [True, False])
    assert other.goal_distance(states).tolist() == [1.0, 1.0]


def test_success_takes_no_part_in_distances_and_perturbations() -> None:
    model = adapt(Cart())
    assert model.distance(np.array([[0.3, 0.4, 1.0]]), np.zeros(3)) == pytest.approx([0.5])
    drawn = model.perturb(np.array([0.0, 0.0, 1.0]), 0.1, 50, np.random.default_rng(0))
    assert model.is_valid(drawn).all()
    assert (drawn[:, 2] == 0.0).all()
    assert (np.linalg.norm(drawn[:, :2], axis=1) <= 0.1).all()


def test_a_robot_is_put_into_states_with_the_flag() -> None:
    class Disc:
        place, symmetries, turning = (0, 1), (), 0.0

        def heading(self, observations: np.ndarray) -> np.ndarray:
            return np.zeros(len(observations))

        def fallen(self, observations: np.ndarray) -> np.ndarray:
            return np.zeros(len(observations), bool)

        def turned(self, observations: np.ndarray, angles: np.ndarray) -> np.ndarray:
            return observations

        def put(self, states: np.ndarray, places: np.ndarray, angles: np.ndarray) -> np.ndarray:
            assert states.shape[1] == 2
            return states + places

    model = adapt(type("Rolling", (Cart,), {"robot": Disc()})())
    put = robot_of(model).put(np.array([[0.5, 0.5, 1.0]]), np.ones((1, 2)), np.zeros(1))
    np.testing.assert_array_equal(put, [[1.5, 1.5, 0.0]])


def test_an_attribute_that_is_called_robot_by_chance_does_no_harm() -> None:
    class Arm:
        place, battery = (0, 1), 0.5

    model = adapt(type("Moving", (Cart,), {"robot": Arm()})())
    assert len(model.initial_state(0)) == 3
    lacks = "has no symmetries, turning, heading, fallen, turned, put; expected all of place"
    with pytest.raises(Mismatch, match=lacks):
        robot_of(model)


def test_misspelt_attributes_are_reported() -> None:
    class Misspelt(Cart):
        bin_sise = 0.1

        def is_vaild(self, states: np.ndarray) -> np.ndarray:
            return np.ones(len(states), bool)

    with pytest.warns(UserWarning, match="has 'bin_sise', which is not read; did you mean 'bin_size'") as caught:
        report = check_resettable(Misspelt())
    assert any("'is_vaild'" in str(warning.message) for warning in caught)
    assert "did you mean 'is_valid'" in str(report)
    assert not report.ok


@pytest.mark.parametrize(("attribute", "value"), [
    ("parallel_batch", 0), ("parallel_batch", 2.5), ("observe", 3), ("bin_size", "small"), ("walls", "none")])
def test_attributes_have_their_types(attribute: str, value: Any) -> None:
    with pytest.raises(InvalidOption, match=f"the environment's {attribute} is"):
        adapt(type("Wrong", (Cart,), {attribute: value})())


def test_a_cart_passes_the_check() -> None:
    report = check_resettable(Cart())
    assert report.ok, str(report)
    assert "is resettable" in str(report)


def test_a_distance_to_the_goal_is_used() -> None:
    class WithGoal(Cart):
        goal_threshold = 0.25

        def goal_distance(self, states: np.ndarray) -> np.ndarray:
            return np.abs(states[:, 0] - 1.0)

    result = adapt(WithGoal()).transition(np.array([[0.8, 0.0], [0.5, 0.0]]), np.zeros((2, 1)))
    np.testing.assert_array_equal(result.success, [True, False])


def test_the_observation_serves_as_state_and_gives_the_bounds() -> None:
    class Plain(Cart):
        observation_space = gymnasium.spaces.Box(-5.0, 5.0, (2,), np.float64)
        state_low = state_high = property()  # type: ignore[assignment]

        def reset(self, **kwargs: Any) -> Any:
            super().reset(**kwargs)
            return self.state.copy(), {}

        def step(self, action: Any) -> Any:
            _, *rest = super().step(action)
            return self.state.copy(), *rest

    class Unobserved(Plain):
        observe = property()  # type: ignore[assignment]

    model = adapt(Unobserved())
    assert model.capabilities == {"visited", "exact"}
    np.testing.assert_array_equal(model.state_high, [5.0, 5.0, 1.0])
    np.testing.assert_array_equal(model.observe(np.array([[1.0, 2.0, 0.0]])), [[1.0, 2.0]])


class Seen(Cart):
    """Two methods and nothing else; what is observed is no function of the state that a user could write in a line."""

    observe = state_low = state_high = feature_dims = property()  # type: ignore[assignment]

    def reset(self, **kwargs: Any) -> Any:
        super().reset(**kwargs)
        return np.array([-1.0]), {}

    def step(self, action: Any) -> Any:
        _, *rest = super().step(action)
        return np.array([self.state[0] * action[0]]), *rest


def test_two_methods_are_enough() -> None:
    report = check_resettable(Seen())
    assert report.ok, str(report)
    model = adapt(Seen())
    assert model.capabilities == {"visited", "exact"}
    start = model.initial_state(0)
    first = model.transition(start[None], np.array([[1.0]])).states
    second = model.transition(first, np.array([[0.5]])).states
    np.testing.assert_allclose(model.observe(np.concatenate([start[None], first, second])), [[-1.0], [0.01], [0.0125]])


def test_an_observation_of_the_shape_of_the_state_is_not_taken_for_it() -> None:
    class Mirrored(Cart):
        observation_space = gymnasium.spaces.Box(-5.0, 5.0, (2,), np.float64)
        observe = state_low = state_high = property()  # type: ignore[assignment]

        def reset(self, **kwargs: Any) -> Any:
            super().reset(**kwargs)
            return -self.state, {}

        def step(self, action: Any) -> Any:
            _, *rest = super().step(action)
            return -self.state, *rest

    model = adapt(Mirrored())
    after = model.transition(model.initial_state(0)[None], np.array([[1.0]])).states
    np.testing.assert_allclose(model.observe(after), [[-0.01, -0.1]])


def test_rules_read_the_state_of_an_environment_that_offers_it() -> None:
    model = adapt(Seen(), feature="state[0]", goal="state[1]>0.15")
    after = model.transition(model.initial_state(0)[None], np.array([[1.0]]))
    assert not after.success[0]
    after = model.transition(after.states, np.array([[1.0]]))
    assert after.success[0]
    np.testing.assert_allclose(model.feature(after.states), [[0.03]])


def test_what_an_environment_declares_bounds_its_state_as_a_feature() -> None:
    model = adapt(Cart(), feature="state[1]")
    np.testing.assert_array_equal((model.feature_low, model.feature_high), [[-1.0], [1.0]])
    assert adapt(Cart(), goal="obs>1").feature_high.tolist() == [5.0]


def test_a_feature_does_not_change_what_a_success_is() -> None:
    class WithGoal(Cart):
        goal_threshold = 0.25

        def step(self, action: Any) -> Any:
            observation, reward, _, _, _ = super().step(action)
            return observation, reward, False, False, {}

        def goal_distance(self, states: np.ndarray) -> np.ndarray:
            return np.abs(states[:, 0] - 0.255)

    after = [adapt(WithGoal(), feature=feature).transition(adapt(WithGoal(), feature=feature).initial_state(0)[None],
                                                           np.array([[1.0]])).success[0] for feature in (None, "obs")]
    assert after == [True, True]


@pytest.mark.parametrize(("members", "complaint"), [
    ({"get_env_state": lambda self: {"qpos": self.state}}, "returned a dict; expected a vector"),
    ({"state_low": np.array([-np.inf, 0.0])}, "finite vectors"),
    ({"state_low": np.zeros(3), "state_high": np.ones(3)}, "state_low has 3 dimensions"),
    ({"feature_dims": (5,)}, "feature_dims"),
    ({"goal_distance": lambda self, states: states[:, 0]}, "set both"),
])
def test_incomplete_environments(members: dict[str, Any], complaint: str) -> None:
    with pytest.raises(NotResettable, match=complaint):
        adapt(type("Incomplete", (Cart,), members)())


def test_bad_batches() -> None:
    model = adapt(Cart())
    with pytest.raises(InvalidState, match=r"\[B, 3\]"):
        model.transition(np.zeros((1, 2)), np.zeros((1, 1)))
    with pytest.raises(InvalidOption, match="not finite"):
        model.transition(np.zeros((1, 3)), np.full((1, 1), np.nan))
    with pytest.raises(InvalidOption, match="cannot be steered"):
        model.advance_towards(np.zeros((1, 3)), np.zeros((1, 1)))


class Forgetful(Cart):
    """Does not restore its speed."""

    def set_env_state(self, state: np.ndarray) -> None:
        self.state = np.array([state[0], self.state[1]])


class Aliased(Cart):
    """Returns its own array, and changes it in place."""

    def get_env_state(self) -> np.ndarray:
        return self.state

    def set_env_state(self, state: np.ndarray) -> None:
        self.state = state


class Noisy(Cart):
    """Has a random step."""

    def step(self, action: Any) -> Any:
        self.state[1] += 0.01 * np.random.default_rng().normal()
        return super().step(action)


class Raising(Cart):
    """Fails in the middle."""

    def step(self, action: Any) -> Any:
        raise ZeroDivisionError("oh no")


class Hidden(Cart):
    """Keeps a part of the state to itself."""

    ticks = 0

    def step(self, action: Any) -> Any:
        self.ticks += 1
        return super().step(np.asarray(action) * np.cos(self.ticks))


@pytest.mark.parametrize(("fault", "failing"), [
    (Forgetful, "attribute 'state'.*set_env_state does not set it"),
    (Aliased, "returned arrays are copies"),
    (Noisy, "steps are random, or depend on what is outside of it: fresh instances differ in state"),
    (Raising, "ZeroDivisionError: oh no"),
    (Hidden, "attribute 'ticks'"),
])
def test_faults_are_described_and_never_raised(fault: type[Cart], failing: str) -> None:
    report = check_resettable(fault())
    assert not report.ok
    assert any(re.search(failing, str(check)) and not check.ok for check in report.checks), str(report)
    assert "FAIL" in str(report)


def test_an_environment_that_cannot_be_adapted_gets_a_report_too() -> None:
    env = gymnasium.make("Pendulum-v1")
    report = check_resettable(gymnasium.wrappers.FrameStackObservation(env, 2))
    assert not report.ok
    assert "FrameStackObservation" in str(report)
