"""Restored states continue as fresh instances do; an instance with a past is not called random."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import NotResettable, UnsupportedSpace
from pbcs_ompl.resettable import adapt, check_resettable, make
from pbcs_ompl.resettable.adapters.visited import CopiedEnv, FreshEnv, ReplayedEnv
from pbcs_ompl.resettable.branching import first_difference
from tests.resettable.toys import Line


class Worn(Line):
    """Each reset leaves something behind, as the caches of some physics engines do."""

    def __init__(self) -> None:
        self.resets = 0

    def begin(self) -> None:
        self.resets += 1

    def push(self, action: float) -> float:
        return (0.1 + 1e-9 * self.resets) * action


class Scales(Line):
    """Changes its action in place."""

    def step(self, action: Any) -> Any:
        action *= 0.5
        return super().step(action)


class ScalesState(Scales):
    """The same with a state of its own."""

    observation_space = gymnasium.spaces.Box(-9.0, 9.0, (1,), np.float64)

    def get_env_state(self) -> Any:
        return np.array([self.x])

    def set_env_state(self, state: Any) -> None:
        self.x = float(state[0])
        state += 100.0


def test_an_instance_with_a_past_is_restored_in_fresh_ones() -> None:
    with pytest.warns(UserWarning, match="does not do the same after a reset.*fresh instance.*slow"):
        model: Any = adapt(Worn())
    assert isinstance(model.env, FreshEnv)
    assert first_difference(model.env, Worn, steps=20, seed=4) == ""
    with pytest.warns(UserWarning, match="slow"):
        report = check_resettable(Worn())
    assert report.ok, str(report)


def test_a_plan_in_fresh_instances_holds() -> None:
    with pytest.warns(UserWarning, match="slow"):
        result = plan(Worn(), "Ex", seed=0, max_transitions=300, goal="obs[0]>0.5")
    assert result.solved


@pytest.mark.parametrize("kind", [Scales, ScalesState])
def test_actions_and_states_are_given_as_copies(kind: type[Line]) -> None:
    model = adapt(kind())
    control = np.full((1, 1), 0.8)
    states = model.initial_state(0)[None]
    given = states.copy()
    after = model.transition(states, control)
    assert control[0, 0] == 0.8
    np.testing.assert_array_equal(states, given)
    assert after.states[0, 0] == pytest.approx(0.04)
    result = plan(kind(), "Ex", seed=0, max_transitions=5000, goal="obs[0]>0.5")
    assert result.solved
    assert result.trajectory is not None
    env = kind()
    env.reset(seed=0)
    for action in result.trajectory.actions:
        observation = env.step(np.array(action))[0]
    assert observation[0] > 0.5


def test_random_steps_are_called_random() -> None:
    class Dice(Line):
        def push(self, action: float) -> float:
            return 0.1 * action + 1e-3 * np.random.default_rng().normal()

    said = r"steps are random, or depend on what is outside of it: fresh instances differ in observation\[0\] at step 1"
    with pytest.raises(NotResettable, match=said):
        adapt(Dice())


class Stateful(Line):
    """Has a state of its own, and something beside it."""

    observation_space = gymnasium.spaces.Box(-9.0, 9.0, (1,), np.float64)

    def begin(self) -> None:
        self.ticks, self.last, self.key = 0, 0.0, False

    def get_env_state(self) -> Any:
        return np.array([self.x])

    def set_env_state(self, state: Any) -> None:
        self.x = float(state[0])


def made(push: Any) -> Stateful:
    """Return an environment with a state of its own whose steps do `push`."""
    return type("Made", (Stateful,), {"push": push})()


def test_what_set_env_state_leaves_out_is_named() -> None:
    def push(self: Any, action: float) -> float:
        self.key = self.key or self.x < -3.0
        return 0.1 * action * (0.5 if self.key and self.x > 1.0 else 1.0)

    with pytest.raises(NotResettable, match="attribute 'key' and read it, and set_env_state does not set it"):
        adapt(made(push))


def test_a_limit_of_its_own_is_named() -> None:
    class Limited(Stateful):
        def step(self, action: Any) -> Any:
            self.ticks += 1
            *rest, _, info = super().step(action)
            return *rest, self.ticks >= 200, info

    with pytest.raises(NotResettable, match="attribute 'ticks'"):
        adapt(Limited())


def test_counters_and_caches_are_no_state() -> None:
    def push(self: Any, action: float) -> float:
        self.ticks += 1
        self.last = 0.1 * action
        return float(self.last)

    model = adapt(made(push))
    assert len(model.state_low) == 2


def test_copies_are_still_preferred() -> None:
    model: Any = adapt(Line())
    assert isinstance(model.env, CopiedEnv)


def test_pixels_are_refused_at_once() -> None:
    class Pixels(Line):
        observation_space = gymnasium.spaces.Box(0, 255, (64, 64, 3), np.uint8)  # type: ignore[assignment]

        def reset(self, **_: Any) -> Any:
            raise AssertionError("nothing runs")

    with pytest.raises(UnsupportedSpace, match="vectors of numbers, such as the state"):
        adapt(Pixels())


def test_copies_that_close_the_original_do_no_harm() -> None:
    class Served(Line):
        """Its copies share a connection, and the end of a copy is the end of the connection."""

        def __init__(self) -> None:
            super().__init__()
            self.connection, self.is_copy = [True], False

        def __deepcopy__(self, memo: dict[int, Any]) -> "Served":
            copy = Served()
            copy.connection, copy.is_copy = self.connection, True
            return copy

        def __del__(self) -> None:
            if self.is_copy:
                self.connection[0] = False

        def reset(self, **options: Any) -> Any:
            assert self.connection[0], "not connected"
            return super().reset(**options)

    gymnasium.register("Served-v0", Served)
    try:
        model: Any = make("Served-v0")
        assert isinstance(model.env, ReplayedEnv)
        model.initial_state(0)
    finally:
        gymnasium.registry.pop("Served-v0")
