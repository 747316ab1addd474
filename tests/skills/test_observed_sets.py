"""Activation sets seen from outside: where observations show the distance, the sets are the same."""

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.resettable import make
from pbcs_ompl.skills.observed_sets import observed_ball, observed_metric


def states_of(model, steps=150):
    """States of a random walk [T, D]."""
    rng, states = np.random.default_rng(0), [model.initial_state(0)]
    for _ in range(steps):
        control = rng.uniform(model.action_low, model.action_high)
        outcome = model.transition(states[-1][None], control[None])
        states.append(model.initial_state(0) if outcome.ended[0] else outcome.states[0])
    return np.array(states)


@pytest.mark.parametrize("env_id", ["pbcs/Maze-v0", "MountainCarContinuous-v0", "PointMaze_UMaze-v3"])
def test_the_observed_ball_is_the_ball(env_id):
    if env_id.startswith("Point"):
        pytest.importorskip("gymnasium_robotics")
    model = make(env_id)
    states = states_of(model)
    radius = float(np.median(model.distance(states, states[0])))
    weights = observed_metric(model, states[::3], radius)
    assert weights is not None
    assert (weights >= 0).all()
    for centre in states[::40]:
        distances = model.distance(states, centre)
        clear = abs(distances - radius) > 0.02 * radius
        inside = observed_ball(model, centre, radius, weights).contains(model.observe(states))
        np.testing.assert_array_equal(inside[clear], (distances <= radius)[clear])
        assert 0 < inside.sum() < len(states)


def test_a_distance_that_is_not_observed_is_known_to_be_hidden():
    """The cheetah does not observe how far it has run, and the pendulum's angle is observed by sine and cosine."""
    pytest.importorskip("mujoco")
    model = make("HalfCheetah-v5")
    states = states_of(model, 60)
    assert observed_metric(model, states, 0.5) is None


def test_the_samples_show_every_dimension():
    """A plan that moves along one axis only says nothing of the other: states around it have to."""
    model = make("pbcs/Maze-v0", {"size": 3})
    line = np.column_stack([np.linspace(0.3, 0.7, 20), np.full(20, 0.5)])
    around = line + np.random.default_rng(0).normal(scale=0.05, size=line.shape)
    np.testing.assert_allclose(observed_metric(model, np.concatenate([line, around]), 0.1), 1.0, rtol=1e-6)


def test_dictionaries_are_observed_by_their_names():
    pytest.importorskip("gymnasium_robotics")
    model, env = make("PointMaze_UMaze-v3"), gymnasium.make("PointMaze_UMaze-v3")
    observation, _ = env.reset(seed=3)
    seen = model.observe(model.initial_state(3)[None])[0]
    expected = np.concatenate([observation[name] for name in sorted(observation)])
    np.testing.assert_allclose(seen, expected)
