"""One adapter for each family of environments: what is restored continues bit for bit."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils import EzPickle

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidState, NotResettable
from pbcs_ompl.resettable import adapt, check_resettable, make
from pbcs_ompl.resettable.adapters.classic import AttributeEnv
from pbcs_ompl.resettable.adapters.get_set import GetSetStateModel
from pbcs_ompl.resettable.adapters.visited import CopiedEnv, ReplayedEnv, child_hash, copies_are_faithful
from pbcs_ompl.resettable.fresh import fresh_maker


class Slider(gymnasium.Env):
    """A point on a line with hidden parts of its state, and no way to set them."""

    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float64)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,), np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.hidden = {"place": float(self.np_random.uniform(-0.1, 0.1)), "speed": 0.0}
        return np.array([self.hidden["place"]]), {}

    def step(self, action: Any) -> Any:
        self.hidden["speed"] = 0.9 * self.hidden["speed"] + 0.02 * float(action[0])
        self.hidden["place"] += self.hidden["speed"]
        done = abs(self.hidden["place"]) > 0.8
        return np.array([self.hidden["place"]]), float(done), done, False, {}


class Uncopyable(Slider):
    def __deepcopy__(self, memo: Any) -> Any:
        raise TypeError("cannot pickle a simulator")


class ForgetfulCopy(Slider):
    """As gymnasium.utils.EzPickle: the copy is a new environment."""

    def __deepcopy__(self, memo: Any) -> Any:
        copy = type(self)()
        copy.reset(seed=0)
        return copy


class Dice(Slider):
    def step(self, action: Any) -> Any:
        return super().step(action + np.random.default_rng().normal(size=1))


class Built(Slider):
    """Each instance is another one."""

    def __init__(self) -> None:
        self.strength = float(np.random.default_rng().uniform(0.5, 1.0))

    def step(self, action: Any) -> Any:
        return super().step(self.strength * action)


@pytest.mark.parametrize("env_id", ["Pendulum-v1", "MountainCarContinuous-v0"])
def test_classic_control(env_id: str) -> None:
    model: Any = make(env_id)
    assert isinstance(model.env, AttributeEnv)
    report = check_resettable(model)
    assert report.ok, str(report)


def test_steps_are_those_of_the_environment_itself() -> None:
    model: Any = make("MountainCarContinuous-v0")
    raw = gymnasium.make("MountainCarContinuous-v0").unwrapped
    raw.reset(seed=4)
    state = model.initial_state(4)
    for _ in range(50):
        action = raw.action_space.sample()
        observation, reward, *_ = raw.step(action)
        outcome = model.transition(state[None], action[None].astype(float))
        state = outcome.states[0]
        np.testing.assert_array_equal(model.observe(outcome.states)[0], observation)
        assert outcome.rewards[0] == reward


def test_bounds_are_those_of_the_observation_space_where_it_is_the_feature() -> None:
    model: Any = make("MountainCarContinuous-v0")
    assert model.env.bounds.source == "the observation space"
    np.testing.assert_allclose(model.feature_high, [0.6, 0.07])
    pendulum: Any = make("Pendulum-v1")
    assert "random steps" in pendulum.env.bounds.source
    assert (pendulum.feature_low < pendulum.initial_state()[:2]).all()


@pytest.mark.parametrize("planner", ["Ex", "RRT", "KPIECE1"])
def test_mountain_car_is_solved_and_replayed(planner: str) -> None:
    result = plan("MountainCarContinuous-v0", planner, seed=0, max_transitions=100_000)
    assert result.solved
    assert result.replay_ok


def test_a_state_that_says_nonsense_is_refused() -> None:
    model = make("Pendulum-v1")
    state = model.initial_state(0)
    state[-2] = 3.0
    with pytest.raises(InvalidState, match="expected 4 or 8"):
        model.transition(state[None], np.zeros((1, 1)))


def test_copies_serve_where_nothing_else_does() -> None:
    model: Any = adapt(Slider())
    assert isinstance(model.env, CopiedEnv)
    assert model.capabilities == {"visited", "exact"}
    report = check_resettable(model)
    assert report.ok, str(report)


@pytest.mark.parametrize("kind", [Uncopyable, ForgetfulCopy])
def test_actions_are_replayed_where_copies_are_not_faithful(kind: type[Slider]) -> None:
    with pytest.warns(UserWarning, match="replaying its actions, which is slow"):
        model: Any = adapt(kind())
    assert isinstance(model.env, ReplayedEnv)
    start = model.initial_state(5)
    controls = np.linspace(-1, 1, 10)[:, None]
    states = [start]
    for control in controls:
        states.append(model.transition(states[-1][None], control[None]).states[0])
    again = model.transition(np.array(states[:-1]), controls)
    np.testing.assert_array_equal(again.states, states[1:])


class Compiled(type):
    """Classes without a module, as SWIG makes them."""

    @property
    def __module__(cls) -> str:
        raise AttributeError("__module__")


class Packed(metaclass=Compiled):
    pass


class Engine(Uncopyable):
    def __init__(self) -> None:
        self.packed = Packed()


def test_objects_of_classes_without_a_module_are_no_hindrance() -> None:
    gymnasium.register("tests/Engine-v0", Engine)
    try:
        report = check_resettable("tests/Engine-v0")
        assert report.ok, str(report)
    finally:
        del gymnasium.registry["tests/Engine-v0"]


@pytest.mark.parametrize("kind", [Slider, Uncopyable])
def test_visited_states_are_within_the_bounds_whatever_the_seed(kind: type[Slider]) -> None:
    model = adapt(kind())
    start = model.initial_state(2**32 - 1)[None]
    after = model.transition(start, np.full((1, 1), 0.5)).states
    assert model.is_valid(np.concatenate([start, after])).all()


def test_instances_that_differ_are_refused_for_what_they_are() -> None:
    gymnasium.register("tests/Built-v0", Built)
    try:
        with pytest.raises(NotResettable, match=r"constructor drew random numbers.*at step 1"):
            make("tests/Built-v0")
    finally:
        del gymnasium.registry["tests/Built-v0"]


def test_random_steps_are_refused() -> None:
    with pytest.raises(NotResettable, match="steps are random"):
        adapt(Dice())


def test_only_visited_states_can_be_restored() -> None:
    model = adapt(Slider())
    state = model.initial_state(0)
    state[1] = 2.0**40 + 0.5
    with pytest.raises(InvalidState, match="visited"):
        model.transition(state[None], np.zeros((1, 1)))


def test_a_start_is_known_by_its_seed() -> None:
    state = adapt(Slider()).initial_state(7)
    other = adapt(Slider())
    np.testing.assert_array_equal(other.transition(state[None], np.ones((1, 1))).states,
                                  adapt(Slider()).transition(state[None], np.ones((1, 1))).states)


@pytest.mark.parametrize("planner", ["Ex", "RRT", "KPIECE1", "RandomWalk"])
def test_every_planner_works_on_visited_states(planner: str) -> None:
    result = plan(Slider(), planner, seed=1, max_transitions=5000)
    assert result.solved
    assert result.replay_ok


def test_names_are_exact_numbers() -> None:
    name = 3.0
    names = {name}
    for _ in range(1000):
        name = child_hash(name, np.array([0.25]))
        assert name == int(name)
        assert 2**32 <= name < 2**53
        names.add(name)
    assert len(names) == 1001


def test_perturbed_states_are_reached_by_the_simulator() -> None:
    model = make("Pendulum-v1")
    state = model.initial_state(0)
    drawn = model.perturb(state, 0.5, 20, np.random.default_rng(0))
    assert drawn.shape == (20, len(state))
    assert (model.distance(drawn, state) <= 0.5).all()
    assert len(np.unique(drawn[:, 0])) > 2
    with pytest.raises(InvalidState, match="larger"):
        model.perturb(state, -0.0, 20, _Stepping())  # type: ignore[arg-type]


class _Stepping(np.random.Generator):
    """Random numbers that always ask for steps."""

    def __init__(self) -> None:
        super().__init__(np.random.PCG64(0))

    def integers(self, low: int, high: int, size: int) -> Any:  # type: ignore[override]
        return np.full(size, high - 1)


def test_a_model_without_rules_has_plain_options() -> None:
    model = make("Pendulum-v1")
    assert model.spec.kwargs == {}
    assert isinstance(model, GetSetStateModel)


class Rounding(Slider):
    """Its reward is a sum in another order after every reset, as over a set whose members lie elsewhere in memory."""

    resets = 0

    def __deepcopy__(self, memo: Any) -> Any:
        raise TypeError("cannot pickle a simulator")

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        self.resets += 1
        return super().reset(seed=seed, options=options)

    def step(self, action: Any) -> Any:
        observation, _, *rest = super().step(action)
        parts = [0.1, 0.2, 0.3][:: 1 if self.resets % 2 else -1]
        return observation, sum(parts), *rest


def test_rounding_of_rewards_is_no_difference():
    assert sum([0.1, 0.2, 0.3]) != sum([0.3, 0.2, 0.1])
    gymnasium.register("tests/Rounding-v0", entry_point=Rounding)
    try:
        with pytest.warns(UserWarning, match="replaying"):
            model = make("tests/Rounding-v0")
        report = check_resettable(model)
    finally:
        gymnasium.registry.pop("tests/Rounding-v0")
    assert report.ok, report


class Server:
    """A connection that closes when it is deleted."""

    is_open = True

    def __deepcopy__(self, memo: Any) -> "Server":
        return self  # what is copied is the number of the connection

    def __del__(self) -> None:
        Server.is_open = False


class OnAServer(Slider):
    def __init__(self) -> None:
        self.server = Server()


def test_what_holds_a_connection_is_not_copied():
    assert not copies_are_faithful(OnAServer())
    assert copies_are_faithful(Slider())
    assert fresh_maker(OnAServer()) is None
    assert fresh_maker(Slider()) is not None


class Forgetful(Slider, EzPickle):
    """Its copies are made without the option, which its author has forgotten to name."""

    def __init__(self, prize: float = 1.0):
        EzPickle.__init__(self)
        self.prize = prize


def test_options_that_an_author_forgets_in_copies_are_kept():
    gymnasium.register("tests/Forgetful-v0", entry_point=Forgetful)
    try:
        env = gymnasium.make("tests/Forgetful-v0", prize=7.0)
        make_env = fresh_maker(env)
        assert make_env is not None
        assert make_env().unwrapped.prize == 7.0
        wrapped = fresh_maker(gymnasium.wrappers.RescaleAction(env, -2.0, 2.0))
        assert wrapped is not None
        assert wrapped().action_space.high == 2.0
        assert wrapped().unwrapped.prize == 7.0
    finally:
        gymnasium.registry.pop("tests/Forgetful-v0")
