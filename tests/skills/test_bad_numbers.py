"""A NaN ends a training with its name and its update, and what was saved before stays and can be resumed."""

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box

from pbcs_ompl.agents import NonFiniteData
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import CHECKPOINT
from pbcs_ompl.skills import resume, train, training
from pbcs_ompl.skills.method import read_checkpoint

OPTIONS = {"method": "plain", "seed": 0, "max_transitions": 30_000, "settings": {"beta": 5, "max_steps": 10},
           "agent_settings": {"hidden": [8, 8], "batch_size": 10}}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where a training goes that saves a checkpoint after every session and test."""
    monkeypatch.setattr(training, "CHECKPOINT_SECONDS", 0.0)
    monkeypatch.setattr(training, "FIRST_CHECKPOINT_SECONDS", 0.0)
    return tmp_path / "run"


def test_a_nan_from_the_environment_names_the_update_and_leaves_the_checkpoint(folder):
    model = make("pbcs/Maze-v0", {"size": 2})
    healthy, calls = model.transition, []

    def transition(states, controls):
        calls.append(len(states))
        outcome = healthy(states, controls)
        return outcome._replace(rewards=outcome.rewards * (np.nan if len(calls) > 100 else 1.0))

    model.transition = transition
    with pytest.raises(NonFiniteData, match=r"rewards hold NaN or infinity, after update \d+"):
        train(model, out=folder, **OPTIONS)
    snapshot, _ = read_checkpoint(folder / CHECKPOINT)
    before = snapshot.plain["trainer"]["transitions"]
    assert before > 0
    result = resume(folder, max_transitions=before + 200)
    assert (result.solved, result.complete) == (False, False)
    assert before < result.train_transitions <= before + 200


def test_a_nan_in_a_loss_names_the_seed_and_the_update(folder):
    wild = OPTIONS["agent_settings"] | {"critic_learning_rate": 1e30, "actor_learning_rate": 1e30}
    with pytest.raises(NonFiniteData, match=r"loss of seed \d+ is \S+ in update \d+; try a smaller learning rate"):
        train("pbcs/Maze-v0", env_kwargs={"size": 2}, out=folder, **OPTIONS | {"agent_settings": wild})


class Lopsided(gymnasium.Env):
    """A point in a square whose actions reach further one way than the other; the goal is its right edge."""

    observation_space = Box(-1.0, 1.0, (2,), np.float64)
    action_space = Box(np.array([-0.1, -0.5]), np.array([0.5, 0.1]), dtype=np.float64)
    state_low, state_high = np.full(2, -1.0), np.full(2, 1.0)

    def __init__(self):
        self._state = np.zeros(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._state = np.zeros(2)
        return self._state.copy(), {}

    def step(self, action):
        assert self.action_space.contains(np.asarray(action)), action
        self._state = np.clip(self._state + 0.5 * np.asarray(action), -1.0, 1.0)
        success = bool(self._state[0] > 0.9)
        return self._state.copy(), float(success), success, False, {"is_success": success}

    def get_env_state(self):
        return self._state.copy()

    def set_env_state(self, state):
        self._state = np.array(state, dtype=np.float64)


def test_an_asymmetric_action_box_simply_works():
    gymnasium.register("tests/Lopsided-v0", entry_point=Lopsided, max_episode_steps=60)
    result = train("tests/Lopsided-v0", method="pbcs", seed=0, max_transitions=100_000)
    assert result.solved
