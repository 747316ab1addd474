"""Laws of trajectories: saved is loaded, path and back is the same, replay is exact, damage is named."""

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.trajectory import Trajectory, to_path, to_trajectory
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, Mismatch
from pbcs_ompl.core.types import Counter


def walk(model, steps=12, seed=0):
    """Return a random trajectory of a model."""
    rng = np.random.default_rng(seed)
    states, actions = [model.initial_state()], rng.uniform(model.action_low, model.action_high, (steps, 2))
    for action in actions:
        states.append(model.transition(states[-1][None], action[None]).states[0])
    rewards = model.transition(np.array(states[:-1]), actions).rewards
    return Trajectory(model.spec, np.array(states), actions, rewards, "walk", seed)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), steps=st.integers(0, 5), size=st.integers(1, 4))
def test_saved_is_loaded(tmp_path, data, steps, size):
    floats = st.floats(width=64)
    trajectory = Trajectory(EnvSpec("some/Env-v0", {"size": size, "layout": [[1, 0]], "name": "é"}, goal="x > 1"),
                            data.draw(arrays(float, (steps + 1, size), elements=floats)),
                            data.draw(arrays(float, (steps, 2), elements=floats)),
                            data.draw(arrays(float, (steps,), elements=floats)), "Ex", 7)
    trajectory.save(tmp_path / "t.npz")
    loaded = Trajectory.load(tmp_path / "t.npz")
    for field in dataclasses.fields(Trajectory):
        mine, other = getattr(trajectory, field.name), getattr(loaded, field.name)
        same = mine.tobytes() == other.tobytes() if isinstance(mine, np.ndarray) else mine == other
        assert same, field.name
    assert loaded.length == steps


def test_path_and_back_is_the_same(any_square):
    trajectory = walk(any_square)
    with make_problem(any_square, counter=Counter()) as problem:
        path = to_path(trajectory, problem.space_information)
        assert path.check()
        back = to_trajectory(path, problem.space_information, any_square)
    assert back.states.tobytes() == trajectory.states.tobytes()
    assert back.actions.tobytes() == trajectory.actions.tobytes()
    assert back.rewards.tobytes() == trajectory.rewards.tobytes()


def test_controls_of_several_steps_become_actions(square):
    model = square(size=3)
    trajectory = walk(model, steps=6)
    with make_problem(model, counter=Counter()) as problem:
        information = problem.space_information
        information.setMinMaxControlDuration(1, 5)
        path = to_path(trajectory, information)
        state, control = information.allocState(), information.allocControl()
        control[0], control[1] = 0.2, 0.1
        information.propagate(path.getState(0), control, 4, state)
        longer = type(path)(information)
        longer.append(path.getState(0), control, 4.0)
        longer.append(state)
        expanded = to_trajectory(longer, information, model)
        assert longer.check()
    assert expanded.length == 4
    assert expanded.actions.tolist() == [[0.2, 0.1]] * 4
    assert expanded.replays_exactly(model)
    assert expanded.states[-1].tolist()[2] == 4.0


def test_broken_duration_is_refused(square):
    model = square()
    with make_problem(model, counter=Counter()) as problem:
        information = problem.space_information
        path = to_path(walk(model, steps=1), information)
        broken = type(path)(information)
        broken.append(path.getState(0), path.getControl(0), 1.5)
        broken.append(path.getState(1))
        with pytest.raises(Mismatch, match=r"lasts 1\.5"):
            to_trajectory(broken, information, model)


def test_replay_notices_one_bit(any_square):
    trajectory = walk(any_square)
    assert trajectory.replays_exactly(any_square)
    states = trajectory.states.copy()
    states[5, 1] = np.nextafter(states[5, 1], 9.0)
    assert not dataclasses.replace(trajectory, states=states).replays_exactly(any_square)


def test_belongs_to_its_own_environment_only(square):
    model, trajectory = square(), walk(square())
    trajectory.check_belongs_to(model)
    with pytest.raises(Mismatch, match="size=3"):
        trajectory.check_belongs_to(square(size=3))
    with pytest.raises(Mismatch, match="other/Env-v0"):
        dataclasses.replace(trajectory, environment=EnvSpec("other/Env-v0")).check_belongs_to(model)
    with pytest.raises(Mismatch, match=r"gymnasium 0\.1"):
        dataclasses.replace(trajectory, versions={"gymnasium": "0.1"}).check_belongs_to(model)


def test_loaded_belongs_to_its_environment(square, tmp_path):
    model = square()
    walk(model).save(tmp_path / "t.npz")
    Trajectory.load(tmp_path / "t.npz").check_belongs_to(model)


def rewrite(path, **changes):
    with np.load(path) as file:
        contents = {**dict(file), **changes}
    np.savez(path, **{name: array for name, array in contents.items() if array is not None})


def words(path, **changes):
    with np.load(path) as file:
        return np.array(json.dumps({**json.loads(str(file["metadata"])), **changes}))


@pytest.mark.parametrize(("damage", "message"), [
    (lambda p: p.unlink(), "does not exist"),
    (lambda p: p.write_bytes(p.read_bytes()[:-100]), "damaged"),
    (lambda p: p.write_bytes(b""), "damaged"),
    (lambda p: p.write_text("hello"), "damaged"),
    (lambda p: rewrite(p, rewards=None), "lacks rewards"),
    (lambda p: rewrite(p, metadata=np.array("{")), "do not parse"),
    (lambda p: rewrite(p, metadata=np.array("[]")), "do not parse"),
    (lambda p: rewrite(p, metadata=words(p, format=99)), "format 99"),
    (lambda p: rewrite(p, metadata=words(p, colour="red")), "not a trajectory"),
    (lambda p: rewrite(p, states=np.zeros((3, 2))), "damaged"),
    (lambda p: rewrite(p, rewards=np.array(1.0)), "damaged"),
])
def test_damage_is_named(square, tmp_path, damage, message):
    path = tmp_path / "t.npz"
    walk(square()).save(path)
    damage(path)
    with pytest.raises(DamagedFile, match=message):
        Trajectory.load(path)
