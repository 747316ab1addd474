"""Activation sets seen from outside: where observations show the distance, the sets are the same."""

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.resettable import make
from pbcs_ompl.skills.observed_sets import (
    Entries,
    Entry,
    ObservedBall,
    ObservedClassifier,
    observed_ball,
    observed_metric,
)


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


def test_entries_that_are_asked_together_answer_as_each_does():
    rng = np.random.default_rng(14)

    def ball():
        return ObservedBall(rng.random(3), rng.random(3) * (rng.random(3) < 0.7), float(rng.uniform(0.3, 0.8)))

    def classifier():
        return ObservedClassifier(0.5, rng.random(3), np.ones(3), rng.normal(size=(3, 4)), np.zeros(4),
                                  rng.normal(size=(4, 1)), np.zeros(1))

    entries = [Entry(), Entry((ball(),)), Entry((ball(), ball())), Entry((ball(), classifier())),
               Entry((classifier(),)), Entry((ball(), ball(), ball()))]
    observations = rng.random((500, 3))
    inside = np.array([entry.contains(observations) for entry in entries])
    expected = [max(index for index in range(len(entries)) if inside[index, k]) for k in range(500)]
    assert len(set(expected)) >= 4
    np.testing.assert_array_equal(Entries(entries).last(observations), expected)
    for one in (entries[:1], entries[4:5]):
        assert (Entries(one).last(observations) == 0).all()
