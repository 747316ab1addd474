"""What every registered environment of the project promises, whatever it is."""

import json
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from pbcs_ompl.core.errors import MissingDependency
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.core.rendering import check_can_render
from pbcs_ompl.resettable import check_resettable, make
from pbcs_ompl.resettable.adapt import MODEL_MEMBERS

load_environments()
ENV_IDS = sorted(env_id for env_id in gymnasium.registry if env_id.startswith("pbcs/"))
MUJOCO = {"pbcs/AntMaze-v0", "pbcs/SparseHalfCheetah-v0"}
STEERABLE = [env_id for env_id in ENV_IDS if env_id not in {*MUJOCO, "pbcs/CarPark-v0", "pbcs/PlanarQuadrotor-v0"}]
EXPECTED_WARNING = "symmetric and normalized space"  # the thesis's actions are in [-0.1, 0.1]


@pytest.fixture(params=ENV_IDS)
def env_id(request: pytest.FixtureRequest) -> str:
    if request.param in MUJOCO:
        pytest.importorskip("mujoco")
    return request.param


def can_render() -> bool:
    try:
        check_can_render()
    except MissingDependency:
        return False
    return True


def rolled(model: ResettableModel, seed: int, count: int = 40) -> np.ndarray:
    """Return states that a few random episodes visit."""
    rng = np.random.default_rng(seed)
    states = np.tile(model.initial_state(seed), (4, 1))
    visited = [states]
    for _ in range(count // 4):
        controls = rng.uniform(model.action_low, model.action_high, (len(states), len(model.action_low)))
        states = model.transition(states, controls).states
        visited.append(states)
    return np.concatenate(visited)


def test_the_environments_are_found_by_entry_point() -> None:
    assert {"pbcs/Maze-v0", "pbcs/Box-v0", "pbcs/Disc-v0"} <= set(ENV_IDS)


def test_gymnasium_finds_no_fault(env_id: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(gymnasium.make(env_id).unwrapped, skip_render_check=env_id in MUJOCO and not can_render())
    assert [str(w.message) for w in caught if EXPECTED_WARNING not in str(w.message)] == []


def test_it_is_resettable(env_id: str) -> None:
    report = check_resettable(gymnasium.make(env_id))
    assert report.ok, str(report)


def test_its_spec_can_be_stored_as_json(env_id: str) -> None:
    text = gymnasium.spec(env_id).to_json()
    assert isinstance(json.loads(text)["entry_point"], str)
    assert EnvSpec.from_json(text).make().unwrapped.spec.id == env_id


def test_it_survives_pickling(env_id: str) -> None:
    env = gymnasium.make(env_id).unwrapped
    env.reset(seed=3)
    env.step(env.action_space.high)
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(env.step(env.action_space.low)[0], twin.step(env.action_space.low)[0])


def test_two_instances_are_equal(env_id: str) -> None:
    np.testing.assert_array_equal(rolled(make(env_id), 5), rolled(make(env_id), 5))


def test_the_model_is_complete_and_consistent(env_id: str) -> None:
    model = make(env_id)
    assert all(hasattr(model, name) for name in MODEL_MEMBERS)
    states = rolled(model, 1)
    assert model.is_valid(states).all()
    assert model.observe(states).shape == (len(states), model.observation_size)
    assert model.feature(states).shape == (len(states), len(model.feature_low))
    features = model.feature(states)
    assert ((model.feature_low <= features) & (features <= model.feature_high)).all()
    assert model.bin_size.shape == model.feature_low.shape
    for bounds in (model.state_low, model.state_high, model.action_low, model.action_high):
        assert np.isfinite(bounds).all()
    assert model.max_episode_steps > 0
    json.dumps(model.spec.kwargs)
    again = make(model.spec)
    np.testing.assert_array_equal(rolled(again, 1), states)


def test_the_model_returns_fresh_arrays(env_id: str) -> None:
    model = make(env_id)
    states = rolled(model, 2)
    kept = states.copy()
    controls = np.zeros((len(states), len(model.action_low)))
    result = model.transition(states, controls)
    for array in (result.states, model.observe(states), model.feature(states)):
        array += 1.0
    np.testing.assert_array_equal(states, kept)


@pytest.mark.parametrize("env_id", STEERABLE)
def test_steering_stays_in_the_action_box_and_comes_closer(env_id: str) -> None:
    model = make(env_id)
    states = rolled(model, 3)
    targets = model.feature(states) + 1e-3
    controls = model.advance_towards(states, targets)
    assert ((controls >= model.action_low) & (controls <= model.action_high)).all()
    before, after = model.feature(states), model.feature(model.transition(states, controls).states)
    assert np.linalg.norm(after - targets, axis=1).mean() < np.linalg.norm(before - targets, axis=1).mean()
