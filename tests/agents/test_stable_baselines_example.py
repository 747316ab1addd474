"""The example of a third-party agent obeys `pbcs_ompl.skills.agent_interface`."""

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from pbcs_ompl.agents import TD3Settings
from pbcs_ompl.core.errors import InvalidOption, PbcsError, UnknownName
from pbcs_ompl.skills.agent_interface import load_agent

LOW, HIGH = np.array([-1.0, 0.0]), np.array([0.5, 10.0])


@pytest.fixture
def kind(monkeypatch):
    """The class, found as `--agent stable_baselines_agent:StableTD3` finds it in the folder of the examples."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    yield load_agent("stable_baselines_agent:StableTD3")
    sys.modules.pop("stable_baselines_agent")


def filled(kind):
    agent = kind(3, LOW, HIGH, settings=TD3Settings(hidden=(16, 12), batch_size=32), seeds=(0,))
    rng = np.random.default_rng(0)
    agent.add_transitions(rng.normal(size=(1, 60, 3)), rng.uniform(LOW, HIGH, (1, 60, 2)), rng.normal(size=(1, 60)),
                   rng.normal(size=(1, 60, 3)), rng.random((1, 60)) < 0.2)
    return agent


def test_actions_values_and_policy_agree(kind):
    agent = filled(kind)
    agent.train(5)
    observations = np.random.default_rng(1).normal(size=(1, 40, 3))
    actions = agent.act(observations)
    assert ((actions >= LOW) & (actions <= HIGH)).all()
    np.testing.assert_allclose(agent.policy().act(observations[0]), actions[0], atol=1e-5)
    assert agent.value(observations, actions).shape == (1, 40)
    assert agent.num_updates == 5


def test_it_continues_from_a_saved_state(kind):
    first, second = filled(kind), filled(kind)
    first.train(5)
    second.load_state_dict(first.state_dict())
    mine, theirs = first.state_dict(), second.state_dict()
    assert mine.keys() == theirs.keys()
    for name in mine:
        assert np.array_equal(mine[name], theirs[name]), name
    second.train(3)
    assert second.num_updates == 8
    second.clear_replay()
    assert second.state_dict()["rewards"].size == 0


def test_errors_name_what_is_missing():
    with pytest.raises(UnknownName, match="'td3'"):
        load_agent("tdd3")
    with pytest.raises(PbcsError, match="no_such_module"):
        load_agent("no_such_module:Agent")
    with pytest.raises(InvalidOption, match=r"lacks act, explore, .*settings_type\.from_preset"):
        load_agent("json:JSONDecoder")
