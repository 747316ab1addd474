"""Laws of shorter plans: real trajectories, never longer, within what was allowed, the same for the same seed."""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.bridge.improvement.allowance import Allowance
from pbcs_ompl.bridge.improvement.improve import improve
from pbcs_ompl.bridge.improvement.steering import Steering
from pbcs_ompl.bridge.plan import plan, read_plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption
from pbcs_ompl.envs.maze.maze import MazeEnv
from pbcs_ompl.resettable import make

sys.path.insert(0, str(Path(__file__).parents[1]))
from shortest_way import least_steps

PLACES = [("pbcs/Maze-v0", "Ex", {"size": 4, "maze_seed": 3}), ("pbcs/Maze-v0", "KPIECE1", {"size": 3}),
          ("pbcs/Disc-v0", "Ex", {"goal": (2.5, 2.6)}), ("pbcs/Toy1D-v0", "Ex", {}),
          ("MountainCarContinuous-v0", "Rides", {})]


@pytest.mark.parametrize(("env", "planner", "kwargs"), PLACES, ids=lambda value: str(value))
def test_a_shorter_plan_is_one_and_its_numbers_are_true(env, planner, kwargs):
    found = plan(env, planner, env_kwargs=kwargs, seed=1)
    shorter = plan(env, planner, env_kwargs=kwargs, seed=1, improve=500)
    assert shorter.solved
    assert shorter.replay_ok
    assert (shorter.transitions, shorter.nodes) == (found.transitions, found.nodes)  # those of the search
    note, trajectory = shorter.improvement, shorter.trajectory
    assert note is not None
    assert trajectory is not None
    assert note.before == found.path_length
    assert note.after == shorter.path_length == trajectory.length <= note.before
    assert note.transitions <= 500
    assert note.progress["length"][0] == note.before
    assert note.progress["length"][-1] == note.after
    assert all(late < early for early, late in pairwise(note.progress["length"]))
    assert all(early <= late <= 500 for early, late in pairwise(note.progress["transitions"]))
    model = make(env, kwargs)
    np.testing.assert_array_equal(trajectory.rewards,
                                  model.transition(trajectory.states[:-1], trajectory.controls).rewards)
    again = plan(env, planner, env_kwargs=kwargs, seed=1, improve=500).trajectory
    assert again is not None
    assert again.states.tobytes() == trajectory.states.tobytes()


@pytest.mark.parametrize("planner", ["Ex", "Rides"])
def test_plans_come_close_to_the_shortest_with_a_tenth_of_the_transitions(planner):
    ratios = []
    for seed in range(6):
        kwargs = {"size": 7, "maze_seed": seed}
        found = plan("pbcs/Maze-v0", planner, env_kwargs=kwargs, seed=seed, improve="10%")
        assert found.path_length is not None
        ratios.append(found.path_length / least_steps(MazeEnv(**kwargs)))
    assert min(ratios) >= 1.0
    assert np.median(ratios) < 1.3


def test_the_least_number_of_steps_of_a_straight_and_of_a_bent_way():
    assert least_steps(MazeEnv(layout=["+-+-+", "|   |", "+-+-+", "|   |", "+-+-+"], goal=(1.5, 0.5))) == 8
    assert least_steps(MazeEnv(2)) == 11


def test_what_a_plan_leaves_is_read_again_and_trained_along(tmp_path):
    found = plan("pbcs/Maze-v0", env_kwargs={"size": 3}, seed=0, improve="50%", out=tmp_path / "plan")
    back = read_plan(tmp_path / "plan")
    assert back.improvement == found.improvement
    assert back.summary() == found.summary()
    assert Trajectory.load(tmp_path / "plan" / "trajectory.npz").length == found.path_length


def test_a_plan_that_the_environment_does_not_grant_is_replaced_by_the_one_before(monkeypatch):
    """As where a model is not true to its environment."""
    from pbcs_ompl.bridge import plan as module

    usual = module.improve_plan

    def wrong(trajectory, *arguments, **options):
        shorter, note = usual(trajectory, *arguments, **options)
        shorter.states[-1] += 1e-9
        return shorter, note

    monkeypatch.setattr(module, "improve_plan", wrong)
    found = plan("pbcs/Maze-v0", "Ex", env_kwargs={"size": 3}, seed=0, improve=2000)
    assert found.solved
    assert found.improvement is not None
    assert found.path_length == found.improvement.after == found.improvement.before


AMOUNTS = [(5000, Allowance(transitions=5000)), ("5000", Allowance(transitions=5000)), ("10%", Allowance(share=0.1)),
           ("2s", Allowance(seconds=2.0)), ("0.5s", Allowance(seconds=0.5)), (0, Allowance(transitions=0)),
           ("0%", Allowance(share=0.0))]


@pytest.mark.parametrize(("amount", "meant"), AMOUNTS)
def test_amounts(amount, meant):
    assert Allowance.of(amount) == meant


@pytest.mark.parametrize("amount", [-1, "", "x", "1.5", "-2s", "-1%", "nan", "inf", "infs", "3%s", "s", "%"])
def test_wrong_amounts_are_refused_by_name(amount):
    with pytest.raises(InvalidOption, match="improve is"):
        plan("pbcs/Maze-v0", improve=amount)


def test_seconds_bind():
    found = plan("pbcs/Maze-v0", env_kwargs={"size": 4}, seed=0, improve="0.05s")
    assert found.improvement is not None
    assert 0.05 <= found.improvement.seconds < 1.0


def test_what_an_environment_raises_is_named(square):
    found = plan("pbcs/Maze-v0", env_kwargs={"size": 2}, seed=0)
    model = make("pbcs/Maze-v0", {"size": 2})

    def broken(states, controls):
        raise ZeroDivisionError("a broken environment")

    model.transition = broken
    with pytest.raises(CallbackFailed, match="a broken environment"):
        improve(found.trajectory, model, Allowance(transitions=10))


def test_steering_is_right_for_a_double_integrator(square):
    """Held for the steps that it looks ahead, the control leads to the target."""
    model = square(size=4)
    model.action_low, model.action_high = np.full(2, -0.1), np.full(2, 0.1)
    rng = np.random.default_rng(0)

    def step(states, controls):
        velocity = 0.9 * states[:, 2:] + controls
        return np.hstack([states[:, :2] + 0.1 * velocity, velocity])

    states, controls = rng.uniform(-1.0, 1.0, (200, 4)), rng.uniform(-0.1, 0.1, (200, 2))
    steering = Steering(model, states, controls, step(states, controls))
    state = np.array([1.0, 1.0, 0.0, 0.0])
    target = np.array([1.06, 0.97])
    control = steering.control(state, target / model.bin_size)
    assert (np.abs(control) <= 0.1).all()
    away = []
    for _ in range(16):
        state = step(state[None], control[None])[0]
        away.append(np.abs(state[:2] - target).max())
    assert min(away) < 0.5 * 0.25
