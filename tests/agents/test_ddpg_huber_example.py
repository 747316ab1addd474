"""The example of an algorithm in one file obeys the laws of the registered ones, and trains skills."""

import json
from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.agents import DDPG, StackedAgent
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.skills.agent_interface import load_agent


@pytest.fixture
def kind(monkeypatch):
    """The class, found as `--agent examples.ddpg_huber:DDPGHuber` finds it in the folder of the project."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    return load_agent("examples.ddpg_huber:DDPGHuber")


def filled(kind: type[StackedAgent], *seeds: int, scale: float = 1.0, **settings: object) -> StackedAgent:
    chosen = kind.settings_type(hidden=(16, 12), batch_size=32, **settings)
    agent = kind(3, [-1.0, 0.0], [0.5, 10.0], settings=chosen, seeds=seeds)
    rows = [np.random.default_rng(seed) for seed in seeds]
    fields = zip(*([rng.normal(size=(60, 3)), rng.uniform(-1.0, 0.5, (60, 2)), scale * rng.normal(size=60),
                    rng.normal(size=(60, 3)), rng.random(60) < 0.2] for rng in rows), strict=True)
    agent.add_transitions(*(np.stack(field) for field in fields))
    return agent


def test_a_wide_quadratic_region_makes_it_ddpg_with_half_the_loss(kind) -> None:
    reference = type("Reference", (DDPG,), {"gradients": {}})
    mine, ddpg = filled(kind, 1, 2, huber_delta=1e9), filled(reference, 1, 2)
    halved, whole = mine.train(1), ddpg.train(1)
    np.testing.assert_allclose(2.0 * halved["critic_loss"], whole["critic_loss"], rtol=1e-5)
    np.testing.assert_allclose(halved["actor_loss"], whole["actor_loss"], rtol=1e-3, atol=1e-5)


def test_a_stack_equals_separate_agents_and_continues_from_a_saved_state(kind) -> None:
    stack, again = filled(kind, 1, 2), filled(kind, 1, 2)
    stack.train(30)
    again.load_state_dict(stack.state_dict())
    assert np.array_equal(stack.train(10)["critic_loss"], again.train(10)["critic_loss"])
    alone = filled(kind, 2)
    alone.train(40)
    np.testing.assert_allclose(alone.policy().layers[0][0], stack.policy(1).layers[0][0], atol=1e-5)


def test_outliers_change_it_less_than_ddpg(kind) -> None:
    losses = {name: filled(one, 1, scale=1e4).train(1)["critic_loss"][0]
              for name, one in (("huber", kind), ("ddpg", DDPG))}
    assert losses["huber"] < 1e-3 * losses["ddpg"]


def test_hand_written_gradients_refuse_a_loss_that_they_do_not_have(kind) -> None:
    wrong = type("Wrong", (kind,), {"gradients": GRADIENTS})
    with pytest.raises(InvalidOption, match=r"Wrong\.gradients has no gradient of the loss 'huber_critic_loss'"):
        filled(wrong, 1).train(1)
    with pytest.raises(InvalidOption, match="huber_delta"):
        kind.settings_type.from_preset("thesis", huber_delta=0.0)


def test_it_trains_from_the_command_line(kind, tmp_path, capsys) -> None:
    code = main(["train", "--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}', "--agent",
                 "examples.ddpg_huber:DDPGHuber", "--method", "pbcs", "--max-transitions", "12000", "--json",
                 "--out", str(tmp_path / "run")])
    result = json.loads(capsys.readouterr().out.strip().splitlines()[-1])
    assert code == 1
    assert not result["solved"]
    assert result["updates"] > 0
