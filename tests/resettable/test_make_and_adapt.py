"""Every mistake ends in a named error that says what to do."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers

from pbcs_ompl.core.errors import (
    InvalidOption,
    InvalidState,
    MissingDependency,
    NotResettable,
    UnknownName,
    UnsupportedSpace,
)
from pbcs_ompl.core.interfaces import VectorisedEnv
from pbcs_ompl.resettable import adapt, make


@pytest.mark.parametrize(("env_id", "complaint"), [
    ("pbcs/Mase-v0", "did you mean 'pbcs/Maze-v0'"),
    ("pbcs/Maze-v7", "did you mean 'pbcs/Maze-v0'"),
    ("Pendulum-v7", "did you mean 'Pendulum-v1'"),
    ("qqqq", "choose from pbcs/AntMaze-v0, pbcs/Box-v0"),
    ("", "unknown environment"),
    ("not an id!", "unknown environment"),
])
def test_unknown_ids(env_id: str, complaint: str) -> None:
    with pytest.raises(UnknownName, match=complaint):
        make(env_id)


def test_a_module_that_does_not_exist() -> None:
    with pytest.raises(MissingDependency, match="no_such_module"):
        make("no_such_module:Thing-v0")


def test_an_id_with_its_module_can_be_made_again() -> None:
    model = make("pbcs_ompl.envs:pbcs/Maze-v0", {"size": 3})
    assert make(model.spec).spec.id == "pbcs_ompl.envs:pbcs/Maze-v0"


@pytest.mark.parametrize(("kwargs", "error", "complaint"), [
    ({"siez": 3}, InvalidOption, "no option 'siez'; did you mean 'size'"),
    ({"wall_penalti": -1}, InvalidOption, "did you mean 'wall_penalty'"),
    ({"size": 10_000}, InvalidOption, "size=10000"),
    ({"start": [0.5, 1.0]}, InvalidState, "inside a wall"),
])
def test_wrong_options(kwargs: dict[str, object], error: type[Exception], complaint: str) -> None:
    with pytest.raises(error, match=complaint):
        make("pbcs/Maze-v0", kwargs)


def test_the_model_says_how_to_make_it_again() -> None:
    model = make("pbcs/Maze-v0", {"size": 5, "maze_seed": 2, "render_mode": "rgb_array"})
    assert (model.spec.id, model.spec.kwargs) == ("pbcs/Maze-v0", {"size": 5, "maze_seed": 2})
    assert model.max_episode_steps == 500
    assert model.capabilities == {"visited", "arbitrary", "exact"}


def test_a_model_is_adapted_already() -> None:
    model = make("pbcs/Box-v0")
    assert adapt(model) is model


@pytest.mark.parametrize(("thing", "complaint"), [
    ("pbcs/Maze-v0", "call make"), (3, "expected a gymnasium.Env or a ResettableModel, got int"),
])
def test_what_is_no_environment(thing: object, complaint: str) -> None:
    with pytest.raises(NotResettable, match=complaint):
        adapt(thing)


def test_an_incomplete_model_names_what_it_lacks() -> None:
    class Half:
        spec = "half"

        def transition(self) -> None: ...

    with pytest.raises(NotResettable, match=r"Half is no ResettableModel; it lacks action_high, .*walls"):
        adapt(Half())


class Spaces(gymnasium.Env):
    """An environment with the given spaces and nothing else."""

    def __init__(self, action_space: gymnasium.Space, observation_space: gymnasium.Space):
        self.action_space, self.observation_space = action_space, observation_space


class SpacesAndState(Spaces):
    """The same with a state of its own."""

    def get_env_state(self) -> np.ndarray:
        return np.zeros(2)

    def set_env_state(self, state: np.ndarray) -> None: ...


BOX = spaces.Box(-1.0, 1.0, (2,))


@pytest.mark.parametrize(("action", "observation", "complaint"), [
    (spaces.Text(3), BOX, "Text.*expected a Box"),
    (spaces.Dict(push=BOX), BOX, "expected a Box"),
    (spaces.Box(-np.inf, np.inf, (2,)), BOX, "finite bounds"),
    (spaces.Box(-1.0, 1.0, (2, 2)), BOX, "expected a vector"),
    (BOX, spaces.Tuple([BOX]), "Dict of Boxes"),
    (BOX, spaces.Dict(kind=spaces.Discrete(3)), "Dict of Boxes"),
    (BOX, spaces.Discrete(3), "Dict of Boxes"),
])
def test_unsupported_spaces(action: gymnasium.Space, observation: gymnasium.Space, complaint: str) -> None:
    with pytest.raises(UnsupportedSpace, match=complaint):
        adapt(Spaces(action, observation))


@pytest.mark.parametrize(("observation", "complaint"), [
    (spaces.Dict(position=BOX), "Dict: expected a vector Box; flatten"),
    (spaces.Tuple([BOX]), "Tuple"),
    (spaces.Box(0.0, 1.0, (3, 3)), "vector Box"),
    (spaces.Discrete(3), "vector Box"),
])
def test_observations_that_go_with_a_state_of_its_own(observation: gymnasium.Space, complaint: str) -> None:
    with pytest.raises(UnsupportedSpace, match=complaint):
        adapt(SpacesAndState(BOX, observation))


def test_wrappers_of_limits_and_rewards_are_removed() -> None:
    env = wrappers.RecordEpisodeStatistics(gymnasium.make("pbcs/Maze-v0"))
    assert adapt(wrappers.TransformReward(env, lambda reward: 2 * reward)).spec.id == "pbcs/Maze-v0"


@pytest.mark.parametrize("wrap", [
    lambda env: wrappers.FrameStackObservation(env, 2),
    lambda env: wrappers.NormalizeObservation(env),
    lambda env: wrappers.StickyAction(env, 0.5),
    lambda env: wrappers.TimeAwareObservation(wrappers.TimeLimit(env, 100)),
    lambda env: wrappers.DelayObservation(env, 2),
])
def test_wrappers_with_a_memory_are_refused(wrap: object) -> None:
    with pytest.raises(NotResettable, match=r"memory or noise.*leave it out"):
        adapt(wrap(gymnasium.make("pbcs/Maze-v0")))  # type: ignore[operator]


def test_other_wrappers_are_refused_with_a_remedy() -> None:
    env = wrappers.RescaleAction(gymnasium.make("pbcs/Maze-v0"), -1.0, 1.0)
    with pytest.raises(NotResettable, match=r"RescaleAction.*pass env\.unwrapped"):
        adapt(env)
    assert adapt(env.unwrapped).spec.id == "pbcs/Maze-v0"


def test_the_protocol_is_what_the_mazes_offer() -> None:
    assert isinstance(gymnasium.make("pbcs/Maze-v0").unwrapped, VectorisedEnv)
    assert not isinstance(gymnasium.make("Pendulum-v1").unwrapped, VectorisedEnv)
