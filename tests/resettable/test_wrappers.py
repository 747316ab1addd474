"""Wrappers that only transform stay around what is restored; those with a memory are refused."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers

import pbcs_ompl.envs  # noqa: F401  registers pbcs/...
from pbcs_ompl.core.errors import InvalidOption, NotResettable
from pbcs_ompl.resettable import adapt, check_resettable, make
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.task import task_of
from pbcs_ompl.resettable.task_env import TaskEnv, explored_actions

Wrap = Callable[[gymnasium.Env[Any, Any]], gymnasium.Env[Any, Any]]


class Doubled(gymnasium.ObservationWrapper):
    """A user's own, which only transforms."""

    def observation(self, observation: Any) -> Any:
        return 2.0 * flat(observation)


class Halved(gymnasium.ActionWrapper):
    def action(self, action: Any) -> Any:
        return 0.5 * action


class Shifted(gymnasium.RewardWrapper):
    def reward(self, reward: Any) -> Any:
        return reward - 1.0


class Change(gymnasium.ObservationWrapper):
    """Keeps the last observation."""

    def __init__(self, env: Any):
        super().__init__(env)
        self.last = 0.0

    def observation(self, observation: Any) -> Any:
        change = observation - self.last
        self.last = observation
        return change


class Counting(gymnasium.ActionWrapper):
    """Keeps a number that changes nothing yet."""

    calls = 0

    def action(self, action: Any) -> Any:
        self.calls += 1
        return action


class Noisy(gymnasium.ObservationWrapper):
    def observation(self, observation: Any) -> Any:
        return observation + np.random.default_rng().normal()


class Bonus(gymnasium.Wrapper):
    def step(self, action: Any) -> Any:
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward + 1, terminated, truncated, info


class Silent(gymnasium.Wrapper):
    """Changes nothing but the picture."""

    def render(self) -> Any:
        return None


class Point(gymnasium.Env[Any, Any]):
    """The simple way, with a dictionary of observations."""

    action_space = spaces.Box(-0.1, 0.1, (2,), np.float32)
    observation_space = spaces.Dict(position=spaces.Box(-1, 1, (2,), np.float32), side=spaces.Discrete(2))
    state_low, state_high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])

    def _seen(self) -> Any:
        return {"position": self.p.astype(np.float32), "side": int(self.p[0] > 0)}

    def observe(self, states: Any) -> Any:
        return {"position": states.astype(np.float32), "side": states[:, 0] > 0}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.p = np.array((options or {}).get("start", [-0.5, 0.0]))
        return self._seen(), {}

    def step(self, action: Any) -> Any:
        self.p = np.clip(self.p + action, -1.0, 1.0)
        won = bool((self.p > 0.7).all())
        return self._seen(), float(won), won, False, {"is_success": won}

    def get_env_state(self) -> Any:
        return self.p.copy()

    def set_env_state(self, state: Any) -> None:
        self.p = np.array(state)


def pendulum() -> Any:
    return gymnasium.make("Pendulum-v1")


def maze() -> Any:
    return gymnasium.make("pbcs/Maze-v0", size=3)


def point() -> Any:
    return wrappers.TimeLimit(Point(), 100)


def simulated() -> Any:
    pytest.importorskip("mujoco")
    return gymnasium.make("InvertedPendulum-v5")


BASES = [pendulum, maze, point, simulated]
TRANSFORMS: dict[str, Wrap] = {
    "FlattenObservation": wrappers.FlattenObservation,
    "RescaleAction": lambda env: wrappers.RescaleAction(env, -3.0, 3.0),
    "ClipAction": wrappers.ClipAction,
    "TransformReward": lambda env: wrappers.TransformReward(env, lambda reward: 3 * float(reward)),
    "ClipReward": lambda env: wrappers.ClipReward(env, -0.1, 0.1),
    "TransformAction": lambda env: wrappers.TransformAction(env, lambda action: -action, None),
    "TransformObservation": lambda env: wrappers.TransformObservation(env, lambda seen: -flat(seen), None),
    "RepeatAction": lambda env: wrappers.RepeatAction(env, 3),
    "Doubled": Doubled, "Halved": Halved, "Shifted": Shifted, "Silent": Silent,
    "several": lambda env: Doubled(wrappers.RecordEpisodeStatistics(wrappers.RescaleAction(
        wrappers.FlattenObservation(env), -1.0, 1.0))),
}


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("wrap", TRANSFORMS.values(), ids=TRANSFORMS)
def test_a_model_does_what_the_wrapped_environment_does(base: Callable[[], Any], wrap: Wrap) -> None:
    env, model = wrap(base()), adapt(wrap(base()))
    state = model.initial_state(3)
    observation, _ = env.reset(seed=3)
    np.testing.assert_allclose(model.observe(state[None])[0], flat(observation), atol=1e-12)
    rng = np.random.default_rng(0)
    for _ in range(12):
        control = rng.uniform(model.action_low, model.action_high)
        observation, reward, terminated, _, _ = env.step(model.actions.to_action(control))  # type: ignore[attr-defined]
        model.transition(model.initial_state(5)[None], control[None])  # another branch
        outcome = model.transition(state[None], control[None])
        state = outcome.states[0]
        assert outcome.rewards[0] == pytest.approx(float(reward), abs=1e-12)
        assert outcome.terminated[0] == terminated
        np.testing.assert_allclose(model.observe(state[None])[0], flat(observation), atol=1e-12)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("wrap", TRANSFORMS.values(), ids=TRANSFORMS)
def test_the_judge_knows_the_task_by_the_name_that_a_model_has(base: Callable[[], Any], wrap: Wrap) -> None:
    task, model = task_of(wrap(base())), make(wrap(base()))
    assert task.spec == model.spec
    with pytest.raises(InvalidOption, match="in wrappers"):
        make("Doubled(pbcs/Maze-v0)")


def test_transformed_environments_are_resettable() -> None:
    for wrap in TRANSFORMS.values():
        report = check_resettable(wrap(point()))
        assert report.ok, report


def test_time_limits_do_not_count_branches() -> None:
    model = adapt(wrappers.RescaleAction(wrappers.TimeLimit(Point(), 5), -1.0, 1.0))
    state = model.initial_state(0)
    for _ in range(20):
        outcome = model.transition(state[None], np.zeros((1, 2)))
        assert not outcome.ended[0]
    assert model.episode_limit == 5


def test_a_limit_below_repeated_actions_is_reached_sooner() -> None:
    assert adapt(wrappers.RepeatAction(wrappers.TimeLimit(Point(), 100), 3)).episode_limit == 34
    assert adapt(wrappers.TimeLimit(wrappers.RepeatAction(Point(), 3), 100)).episode_limit == 100


def test_the_wrappers_that_are_given_stay_as_they_are() -> None:
    env = wrappers.RescaleAction(wrappers.TimeLimit(Point(), 5), -1.0, 1.0)
    below = env.env
    adapt(env)
    assert env.env is below


def test_flattening_by_hand_or_not_is_the_same_task() -> None:
    plain, flattened = adapt(point()), adapt(wrappers.FlattenObservation(point()))
    controls = np.random.default_rng(0).uniform(-0.1, 0.1, (1, 2))
    start = plain.initial_state(0)
    np.testing.assert_array_equal(start, flattened.initial_state(0))
    for mine, theirs in zip(plain.transition(start[None], controls), flattened.transition(start[None], controls),
                            strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert plain.observation_size == 3, "position and side, a number"
    assert flattened.observation_size == 4, "one number for each side"


def test_goals_are_found_by_name_below_a_flattening_wrapper() -> None:
    pytest.importorskip("gymnasium_robotics")
    plain = make("PointMaze_UMaze-v3")
    assert plain.make_env is not None
    flattened = adapt(wrappers.FlattenObservation(plain.make_env()))
    np.testing.assert_array_equal(plain.feature_low, flattened.feature_low)
    np.testing.assert_array_equal(plain.initial_state(1), flattened.initial_state(1))


def test_clipped_actions_are_drawn_from_what_they_are_clipped_to() -> None:
    env = wrappers.TransformReward(wrappers.ClipAction(pendulum()), lambda reward: reward)
    assert explored_actions(env) == pendulum().action_space


@pytest.mark.parametrize("wrap", [
    lambda env: wrappers.FrameStackObservation(env, 2),
    lambda env: wrappers.NormalizeObservation(env),
    lambda env: wrappers.NormalizeReward(env),
    lambda env: wrappers.StickyAction(env, 0.5),
    lambda env: wrappers.TimeAwareObservation(wrappers.TimeLimit(env, 100)),
    lambda env: wrappers.DelayObservation(env, 2),
    Change, Noisy,
    lambda env: wrappers.TransformObservation(env, lambda seen, past=[]: past.append(0) or seen + len(past), None),
])
def test_wrappers_with_a_memory_are_refused(wrap: Wrap) -> None:
    with pytest.raises(NotResettable, match=r"the wrapper \w+ .*memory or noise.*leave it out"):
        adapt(wrap(gymnasium.make("pbcs/Maze-v0")))


def test_other_wrappers_are_refused_by_name_and_with_a_remedy() -> None:
    with pytest.raises(NotResettable, match=r"Bonus overrides step, so it may have a memory; derive it from"):
        adapt(Bonus(pendulum()))
    with pytest.raises(NotResettable, match="Counting changes its attribute 'calls'"):
        adapt(Counting(pendulum()))


def test_a_wrapper_that_restores_is_taken_for_the_environment() -> None:
    class Restoring(gymnasium.Wrapper):
        state_low, state_high = Point.state_low, Point.state_high

        def observe(self, states: Any) -> Any:
            return Point().observe(states)

        def get_env_state(self) -> Any:
            return self.unwrapped.get_env_state()  # type: ignore[attr-defined]

        def set_env_state(self, state: Any) -> None:
            self.unwrapped.set_env_state(state)  # type: ignore[attr-defined]

        def step(self, action: Any) -> Any:
            return self.env.step(0.5 * action)

    model = adapt(Restoring(wrappers.TimeLimit(Point(), 5)))
    start = model.initial_state(0)
    after = model.transition(start[None], np.array([[0.1, 0.1]])).states[0]
    np.testing.assert_allclose(after[:2] - start[:2], [0.05, 0.05], atol=1e-8)


def test_reset_options_are_those_of_every_reset() -> None:
    model = make(Point(), reset_options={"start": [0.25, 0.25]})
    assert model.initial_state(0)[:2].tolist() == [0.25, 0.25]
    assert isinstance(model.env.inner, TaskEnv)
    model.env.reset(seed=1)
    assert model.env.get_env_state()[:2].tolist() == [0.25, 0.25]
