"""Goals and features given as a line of text or as functions."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.rules import Outcome, feature_rule, goal_rule, reported_success, rule_text


def outcome(observation: Any = (0.0, 1.0, 2.0), reward: float = 0.5, terminated: bool = False, **info: Any) -> Outcome:
    env = SimpleNamespace(data=SimpleNamespace(qpos=np.arange(5.0), qvel=-np.arange(4.0)), state=np.array([7.0, 8.0]))
    return Outcome(env, observation, reward, terminated, info)


def upright(seen: Outcome) -> bool:
    return bool(seen.observation[0] > 0.99)


def height(seen: Outcome) -> np.ndarray:
    return np.array([seen.observation[0]])


@pytest.mark.parametrize(("rule", "expected"), [
    ("obs", [0.0, 1.0, 2.0]), ("obs[1]", [1.0]), ("obs[1:3]", [1.0, 2.0]), ("obs[:2]", [0.0, 1.0]),
    ("obs[1:]", [1.0, 2.0]),
    ("qpos[0:2]", [0.0, 1.0]), ("qvel[3]", [-3.0]), ("state", [7.0, 8.0]), (" qpos[4] , obs[ 0 ] ", [4.0, 0.0]),
    ("reward", [0.5]),
    ("obs[-1]", [2.0]), ("obs[-2:]", [1.0, 2.0]), ("obs[:-1]", [0.0, 1.0]), ("qvel[-1],obs[0]", [-3.0, 0.0]),
    ("|qvel[2:4]|", [2.0, 3.0]), ("obs[:]", [0.0, 1.0, 2.0]),
    ("info[goal][at]", [3.0, -4.0]), ("info[goal][at][-1]", [-4.0]), ("|info[goal][at][0:2]|", [3.0, 4.0]),
    ("info['goal'][\"at\"][0]", [3.0]), ("info[speed]", [0.25]),
])
def test_features(rule: str, expected: list[float]) -> None:
    seen = outcome(goal={"at": np.array([3.0, -4.0])}, speed=np.float32(0.25))
    assert feature_rule(rule)(seen).tolist() == expected


@pytest.mark.parametrize(("rule", "expected"), [
    ("reward>0", True), ("reward > 0.5", False), ("reward>=0.5", True), ("qpos[3]<3", False), ("qpos[3]<=3", True),
    ("|qvel[1]|<=1 and reward>0", True), ("|qvel[1]|<1 and reward>0", False),
    ("obs[-1]>1 and obs[0]<1 and reward<1", True),
    ("info[far]<0.1", False), ("info[near]<0.1 and info[flag]>0", True), ("info[flag]<1", False),
    ("qpos[0:3]<3", True), ("qpos[0:4]<3", False), ("obs[2]>=2.", True), ("terminated>0", False),
])
def test_goals(rule: str, expected: bool) -> None:
    assert goal_rule(rule)(outcome(far=1.0, near=np.array([0.01]), flag=True)) is expected


def test_what_a_reset_does_not_report_is_no_success() -> None:
    assert goal_rule("info[distance]<0.1")(outcome(reward=np.nan)) is False
    assert goal_rule("info[distance]<0.1")(outcome(reward=np.nan, distance=0.05)) is True


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=8), st.data())
def test_a_slice_is_that_of_the_array(values: list[float], data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(values) - 1))
    stop = data.draw(st.integers(start + 1, len(values)))
    np.testing.assert_array_equal(feature_rule(f"obs[{start}:{stop}]")(outcome(np.array(values))), values[start:stop])


def test_dictionaries_are_read_in_the_order_of_their_names() -> None:
    seen = outcome({"b": np.array([2.0]), "achieved_goal": np.array([0.0, 1.0])})
    assert feature_rule("obs")(seen).tolist() == [0.0, 1.0, 2.0]
    assert feature_rule("achieved_goal[1]")(seen).tolist() == [1.0]


@pytest.mark.parametrize(("rule", "complaint"), [
    ("qpso[0:2]", "did you mean 'qpos'"), ("qpos[0:", "does not parse"), ("", "does not parse"), ("qpos[-6]", "0 to 4"),
    ("|obs[0]", "parse"), ("obs[0][1]", "parse"), ("info", "parse"),
    ("qpos[0:9]", "qpos has 5 numbers, 0 to 4"), ("qpos[5]", "0 to 4"), ("qpos[3:2]", "0 to 4"),
    ("achieved_goal", "no 'achieved_goal'"), ("nowhere_to_be_found:f", "no such function"), ("math:nothing", "no such"),
])
def test_bad_features(rule: str, complaint: str) -> None:
    with pytest.raises(InvalidOption, match=complaint):
        feature_rule(rule)(outcome())


@pytest.mark.parametrize(("rule", "complaint"), [
    ("reward>nan", "no finite number"), ("reward>1e999", "no finite number"), ("reward<-inf", "no finite number"),
    ("obs[0]==1", "there is no ==.*say how near"), ("obs[0]!=1 and reward>0", "there is no !="),
    ("reward>0 and", "expected a number"), ("reward>0 and obs[0]", "compares nothing"), ("info[speed]>1", "no 'speed'"),
    ("info[name]>1", "expected numbers"), ("info[dist]<1", "did you mean 'distance'"),
    ("reward>much", "expected a number"), ("reward", "compares nothing"), ("rewrd>0", "did you mean 'reward'"),
])
def test_bad_goals(rule: str, complaint: str) -> None:
    with pytest.raises(InvalidOption, match=complaint):
        goal_rule(rule)(outcome(distance=0.5, name="ball"))


def test_mujoco_words_need_mujoco() -> None:
    with pytest.raises(InvalidOption, match="no MuJoCo environment"):
        make("Pendulum-v1", feature="qpos[0]")


def test_what_the_environment_reports() -> None:
    assert reported_success(outcome(is_success=True))
    assert reported_success(outcome(success=1.0, terminated=False))
    assert not reported_success(outcome(success=False, terminated=True))
    assert reported_success(outcome(reward=1.0, terminated=True))
    assert not reported_success(outcome(reward=-1.0, terminated=True))


@pytest.mark.parametrize(("value", "success"), [
    (np.bool_(True), True), (np.array([True]), True), (1.0, True), (np.float32(0.0), False), (None, False),
    (float("nan"), False), (np.array([np.nan]), False)])
def test_success_in_other_types(value: Any, success: bool) -> None:
    assert reported_success(Outcome(None, None, 1.0, False, {"is_success": value})) is success


@pytest.mark.parametrize("value", ["False", [], [True, False], {}])
def test_what_is_no_success_is_refused(value: Any) -> None:
    with pytest.raises(CallbackFailed, match="expected True or False"):
        reported_success(Outcome(None, None, 1.0, False, {"success": value}))


def test_functions_are_rules() -> None:
    model = make("Pendulum-v1", goal=upright, feature=height)
    assert model.spec == EnvSpec("Pendulum-v1", {}, f"{__name__}:upright", f"{__name__}:height")
    assert model.feature_low.shape == (1,)
    again = make(model.spec)
    np.testing.assert_array_equal(again.initial_state(3), model.initial_state(3))


def test_the_start_can_be_fixed() -> None:
    free, fixed = make("Pendulum-v1"), make("Pendulum-v1", start_seed=3)
    np.testing.assert_array_equal(fixed.initial_state(7), free.initial_state(3))
    assert fixed.spec == EnvSpec("Pendulum-v1", start_seed=3)
    with pytest.raises(InvalidOption, match="start_seed is -1; expected an integer >= 0"):
        make("Pendulum-v1", start_seed=-1)


def test_functions_have_to_be_found_again() -> None:
    with pytest.raises(InvalidOption, match="top level"):
        rule_text("goal", lambda seen: True)
    with pytest.raises(InvalidOption, match="top level"):
        rule_text("goal", 3)  # type: ignore[arg-type]


def test_a_rule_goes_with_an_environment_that_has_its_own_state() -> None:
    model = make("pbcs/Maze-v0", {"size": 2}, goal="obs[0]>1.2", feature="obs[0]")
    assert model.feature_dims == (0,)
    states = model.initial_state()[None]
    assert not (model.goal_distance(states) < model.goal_threshold).any()
    for _ in range(9):
        states = model.transition(states, np.array([[0.1, 0.0]])).states
    assert (model.goal_distance(states) < model.goal_threshold).all()
