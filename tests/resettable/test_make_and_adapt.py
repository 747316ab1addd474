"""Every mistake ends in a named error that says what to do."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

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
    (BOX, spaces.Text(3), "leave out Text"),
    (BOX, spaces.Dict(position=BOX, graph=spaces.Sequence(BOX)), "leave out Sequence"),
    (BOX, spaces.Box(0, 255, (8, 8, 3), np.uint8), "pictures"),
    (BOX, spaces.Dict(camera=spaces.Box(0, 255, (8, 8), np.uint8)), "pictures"),
])
def test_unsupported_spaces(action: gymnasium.Space, observation: gymnasium.Space, complaint: str) -> None:
    with pytest.raises(UnsupportedSpace, match=complaint):
        adapt(Spaces(action, observation))


def test_observations_of_an_environment_with_a_state_of_its_own() -> None:
    with pytest.raises(UnsupportedSpace, match="leave out Text"):
        adapt(SpacesAndState(BOX, spaces.Dict(name=spaces.Text(3))))


def test_the_protocol_is_what_the_mazes_offer() -> None:
    assert isinstance(gymnasium.make("pbcs/Maze-v0").unwrapped, VectorisedEnv)
    assert not isinstance(gymnasium.make("Pendulum-v1").unwrapped, VectorisedEnv)
