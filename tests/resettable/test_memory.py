"""What an environment keeps in attributes is restored where it is plain, and refused by name where it is not."""

import random
from collections import deque
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("mujoco")

from pbcs_ompl.core.errors import InvalidState, NotResettable
from pbcs_ompl.resettable import adapt, check_resettable
from pbcs_ompl.resettable.adapters.restorable import GUARD_EVERY
from pbcs_ompl.resettable.branching import LONG, first_difference
from pbcs_ompl.resettable.memory.code import names_of
from pbcs_ompl.resettable.memory.exploration import ABSENT, Seen
from pbcs_ompl.resettable.memory.plain_values import enum_name, from_text, pack, same, size_for, to_text, unpack
from tests.resettable.toys import Cart, Line, walk


class Phase(Enum):
    LEFT = 1
    RIGHT = 2


KNOWN = {enum_name(Phase): Phase}
SCALARS = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(), st.binary(),
                    st.sampled_from(Phase))
PLAIN = st.recursive(SCALARS, lambda inner: st.one_of(
    st.lists(inner), st.tuples(inner, inner), st.dictionaries(st.text(), inner), st.sets(st.integers()),
    st.lists(inner).map(lambda parts: deque(parts, maxlen=9))), max_leaves=8)


@given(PLAIN)
def test_plain_values_come_back_with_their_types(value: Any) -> None:
    text = to_text(value)
    back = from_text(unpack(pack(text, size_for(len(text)) + 3, "it")), KNOWN)
    assert back == value
    assert same(back, value)


@pytest.mark.parametrize("value", [np.float32(0.1), np.int64(-3), np.array([1.5, np.nan]), np.zeros((2, 0), np.uint8),
                                   np.array(["a", "bc"]), {"x": np.arange(3)}, float("inf"), -0.0])
def test_so_do_those_of_numpy(value: Any) -> None:
    assert same(from_text(to_text(value), {}), value)


@pytest.mark.parametrize("text", [b"", b"[", b'["enum","a:b","c"]', b'["list"]', b'["what",1]', b"[" * 5000])
def test_texts_that_say_nothing_are_refused(text: bytes) -> None:
    with pytest.raises(InvalidState, match="holds no value"):
        from_text(text, {})


class Robot:
    __slots__ = ("arms", "battery")

    def __init__(self) -> None:
        self.battery, self.arms = 1.0, [{"angle": 0.0}]


class Place(NamedTuple):
    x: float


class Flag(Cart):
    """The flag is set far from where random steps lead."""

    def begin(self) -> None:
        self.has_key = False

    def push(self, action: float) -> None:
        super().push(action)
        self.has_key = self.has_key or bool(self.data.qpos[0] < -0.5)

    def reward(self) -> float:
        return float(self.has_key)


class Attributes(Cart):
    """Attributes of many kinds, all of which the force depends on."""

    def begin(self) -> None:
        self.count, self.total, self.name = 0, 0, "none"
        self.trail: list[float] = []
        self.last: float | None = None
        self.seen: set[int] = set()
        self.recent: deque[float] = deque(maxlen=3)
        self.phase = Phase.LEFT
        self.flags = {"on": False, "inner": {"n": 0}}
        self.robot = Robot()
        self.filtered = np.zeros(2)
        self.alias = self.filtered
        self.table = np.arange(3)

    def push(self, action: float) -> None:
        self.count += 1
        self.total += action
        self.name = "even" if self.count % 2 == 0 else "odd"
        self.trail = [*self.trail, action][-4:]
        self.seen.add(int(10 * action) % 4)
        self.recent.append(action)
        self.phase = Phase.RIGHT if action > 0 else Phase.LEFT
        self.flags["on"] = not self.flags["on"]
        self.flags["inner"]["n"] += 2
        self.robot.battery -= 0.01
        self.robot.arms[0]["angle"] += action
        self.filtered *= 0.5
        self.filtered += action
        force = (self.total + (0.0 if self.last is None else self.last) + len(self.name) + sum(self.trail)
                 + len(self.seen) + sum(self.recent) + self.phase.value + self.flags["on"] + self.flags["inner"]["n"]
                 + self.robot.battery + self.robot.arms[0]["angle"] + self.alias.sum() + self.table[self.count % 3])
        self.last = action
        self.data.ctrl[0] = np.sin(force)


@pytest.mark.parametrize("kind", [Flag, Attributes])
def test_attributes_are_restored(kind: type[Cart]) -> None:
    model: Any = adapt(kind())
    assert first_difference(model.env, kind, steps=LONG, seed=2) == ""


def test_attributes_are_restored_in_another_instance() -> None:
    one, other = adapt(Attributes()), adapt(Attributes())
    state, control = one.initial_state(3), np.full((1, 1), 0.7)
    for _ in range(9):
        state = one.transition(state[None], control).states[0]
    np.testing.assert_array_equal(one.transition(state[None], control).states,
                                  other.transition(state[None], control).states)


def test_a_flag_that_random_steps_never_set_is_restored() -> None:
    model: Any = adapt(Flag())
    assert "has_key" in model.env._memory.names
    start = model.initial_state(0)
    state = start
    for _ in range(60):
        state = model.transition(state[None], -np.ones((1, 1))).states[0]
    assert model.transition(state[None], np.ones((1, 1))).rewards[0] == 1.0
    assert model.transition(start[None], np.ones((1, 1))).rewards[0] == 0.0


def numbers() -> Any:
    """Yield forever."""
    value = 0.0
    while True:
        yield (value := value + 0.1)


class Opaque:
    """Has no attributes that can be seen."""

    __slots__ = ()


def refused(**members: Any) -> Cart:
    """Return a cart with members in place of its own."""
    return type("Refused", (Cart,), members)()


@pytest.mark.parametrize(("make", "name"), [(numbers, "gen"), (lambda: iter([0.1] * 10_000), "gen")])
def test_iterators_are_refused_by_name(make: Any, name: str) -> None:
    def begin(self: Any) -> None:
        self.gen = make()

    def push(self: Any, action: float) -> None:
        self.data.ctrl[0] = action + next(self.gen)

    with pytest.raises(NotResettable, match=f"in its attribute '{name}', which changes and cannot be saved"):
        adapt(refused(begin=begin, push=push))


def test_open_files_are_refused_by_name(tmp_path: Any) -> None:
    path = tmp_path / "wind.txt"
    path.write_text("0.1\n" * 100_000)

    def begin(self: Any) -> None:
        self.wind = path.open("rb", buffering=0)

    def push(self: Any, action: float) -> None:
        self.data.ctrl[0] = action + float(self.wind.readline())

    with pytest.raises(NotResettable, match="in its attribute 'wind'"):
        adapt(refused(begin=begin, push=push))


@pytest.mark.parametrize(("draw", "name"), [
    (lambda env: env.np_random.normal(), "np_random"), (lambda _: np.random.normal(), "numpy's global generator"),
    (lambda _: random.random(), "the module random"), (lambda env: env.own.random(), "own")])
@pytest.mark.parametrize("state", [False, True])
def test_random_generators_in_steps_are_refused_by_name(draw: Any, name: str, state: bool) -> None:
    def push(self: Any, action: float) -> None:
        self.data.ctrl[0] = action + 1e-9 * draw(self)

    members: dict[str, Any] = {"push": push, "own": np.random.default_rng(0)}
    env = refused(**members)
    env.own = np.random.default_rng(0)
    if state:
        env = with_state(type(env))()
        env.own = np.random.default_rng(0)
    with pytest.raises(NotResettable, match=f"steps draw random numbers from {name}"):
        adapt(env)


def with_state(kind: type[Cart]) -> type[Cart]:
    """Return a class with a state of its own."""

    def set_env_state(self: Any, state: Any) -> None:
        self.data.qpos[:], self.data.qvel[:] = state[:1], state[1:]

    return type("WithState", (kind,), {
        "get_env_state": lambda self: self._get_obs(), "set_env_state": set_env_state,
        "state_low": np.full(2, -9.0), "state_high": np.full(2, 9.0)})


@pytest.mark.parametrize("sets_back", [True, False])
def test_a_generator_that_set_env_state_sets_back_is_state(sets_back: bool) -> None:
    class Noisy(Line):
        """Noise of a generator; how many numbers were drawn is a part of the state."""

        state_low, state_high = np.array([-9.0, 0.0]), np.array([9.0, 1e6])
        capabilities = frozenset({"visited", "exact"})  # not every number is a number of draws

        def begin(self) -> None:
            self.own, self.draws = np.random.default_rng(7), 0

        def push(self, action: float) -> float:
            self.draws += 1
            return 0.1 * action + 0.01 * float(self.own.normal())

        def get_env_state(self) -> Any:
            return np.array([self.x, self.draws])

        def set_env_state(self, state: Any) -> None:
            self.x, self.draws = float(state[0]), int(state[1])
            if sets_back:
                self.own = np.random.default_rng(7)
                self.own.normal(size=self.draws)

        def observe(self, states: Any) -> Any:
            return np.asarray(states)[:, :1]

    if sets_back:
        report = check_resettable(Noisy())
        assert report.ok, str(report)
    else:
        with pytest.raises(NotResettable, match="steps draw random numbers from own"):
            adapt(Noisy())


def test_random_numbers_in_reset_are_welcome() -> None:
    class Drawn(Line):
        def begin(self) -> None:
            self.x = float(self.np_random.uniform())

    assert adapt(Drawn()).initial_state(1)[0] != adapt(Drawn()).initial_state(2)[0]


def test_what_grows_is_refused_when_it_is_too_long() -> None:
    class Growing(Cart):
        def begin(self) -> None:
            self.trail: list[float] = []

        def push(self, action: float) -> None:
            self.trail.append(action)
            self.data.ctrl[0] = np.sin(sum(self.trail))

    with pytest.raises(NotResettable, match=r"attribute 'trail'.*it grows"):
        walk(Growing, 2000, 0.123456789)


def test_a_log_that_is_never_read_is_no_state() -> None:
    class Logging(Cart):
        def begin(self) -> None:
            self.log: list[float] = []

        def push(self, action: float) -> None:
            super().push(action)
            self.log.append(action)

    model: Any = adapt(Logging())
    assert "log" not in model.env._memory.names


def test_what_code_does_not_show_is_refused_when_it_changes() -> None:
    class Sly(Cart):
        def __init__(self) -> None:
            super().__init__()
            self.mode = 0

        def push(self, action: float) -> None:
            super().push(action * (1 - self.mode))
            if self.data.qpos[0] > 2.0:
                vars(self)["mo" + "de"] = 1

    with pytest.raises(NotResettable, match="attribute 'mode' has changed"):
        walk(Sly, 2 * GUARD_EVERY, 1.0)


def test_names_in_code() -> None:
    class Uses:
        def step(self) -> None:
            self.a = 1
            self.b += 1
            self.c[0] = self.d
            self.e.append(2)
            self.helper()

        def helper(self) -> None:
            self.f.clear()

        def render(self) -> None:
            self.g = 1

        def unused(self) -> None:
            self.h = 1

    found = names_of([Uses], ["step"])
    assert {"a", "b", "c", "e", "f"} <= found.stored
    assert not {"g", "h"} & (found.stored | found.loaded)
    assert "d" in found.loaded
    assert "e" not in found.loaded


def test_numbers_that_are_not_finite_are_restored() -> None:
    class Closest(Cart):
        def begin(self) -> None:
            self.closest, self.worst = np.inf, np.full(2, -np.inf)

        def push(self, action: float) -> None:
            super().push(action)
            self.closest = min(self.closest, abs(float(self.data.qpos[0]) - 1.0))
            self.worst[0] = max(self.worst[0], action)

        def reward(self) -> float:
            return self.closest + float(self.worst[0])

    model: Any = adapt(Closest())
    assert np.isfinite(model.initial_state(0)).all()
    assert first_difference(model.env, Closest, steps=LONG, seed=5) == ""


def test_an_attribute_may_be_absent_for_several_steps() -> None:
    seen = Seen([1])
    for value in (ABSENT, ABSENT, [1]):
        seen.add(value, "step")
    assert seen.changes
