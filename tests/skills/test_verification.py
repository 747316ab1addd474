"""PBCS verifies its complete chain by a sequential test, and trains the skill again in which executions fail."""

from itertools import pairwise

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.skills import method_settings
from pbcs_ompl.skills.agent_interface import load_agent
from pbcs_ompl.skills.observed_sets import Entry
from pbcs_ompl.skills.pbcs import PBCS, ChainLink
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

MODEL = make("pbcs/Maze-v0", {"size": 2})


@pytest.fixture
def trainer():
    states = pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs={"size": 2}, seed=0).trajectory.states
    settings, kind = method_settings("pbcs"), load_agent("ddpg")
    chosen = kind.settings_type.from_preset("fast")
    spaces = settings.agent_spaces(MODEL)
    return SkillTrainer(lambda seed, horizon=1.0: kind(*spaces, settings=chosen, seeds=(seed,), device="cpu"),
                        Waypoints.of_plan(states, MODEL, settings), settings.episodes, Counter(),
                        np.random.default_rng(0))


@pytest.fixture
def complete(trainer):
    """PBCS with three untrained skills from the start to the goal."""
    method = PBCS(trainer, method_settings("pbcs"))
    last, policy = trainer.waypoints.last, trainer.policy()
    cuts = [0, last // 3, 2 * last // 3, last]
    method.links = [ChainLink(start, end, policy, trainer.waypoints.ball(start), Entry())
                    for start, end in pairwise(cuts)]
    method._train_between(0, 0)
    assert method.complete
    assert not method.done
    return method


def scripted(monkeypatch, failing):
    """Let `failing(epsilon, executions before)` say in which skill an execution fails, None for none; count them."""
    counts = {0.0: 0, 0.1: 0}

    def failures(self, chain, count, epsilon):
        ended = [failing(epsilon, counts[epsilon] + one) for one in range(count)]
        counts[epsilon] += count
        return np.array([skill for skill in ended if skill is not None], dtype=np.int64)

    monkeypatch.setattr(PBCS, "_failures", failures)
    return counts


def test_a_chain_that_never_fails_is_accepted_after_as_few_executions_as_the_gate_allows(complete, monkeypatch):
    counts = scripted(monkeypatch, lambda epsilon, number: None)
    complete.step()
    assert complete.done
    assert counts == {0.0: 1, 0.1: complete.settings.gate.most_needed(0, 0)}


def test_the_skill_in_which_most_fail_is_trained_again(complete, monkeypatch):
    counts = scripted(monkeypatch, lambda epsilon, number: 1 if epsilon and number % 2 else None)
    middle = complete.links[1]
    complete.step()
    assert not complete.done
    assert (complete.min_index, complete.end) == (middle.start, middle.end)
    assert middle not in complete.links
    assert counts[0.1] <= 32


def test_a_chain_that_fails_without_noise_is_not_tried_with_it(complete, monkeypatch):
    counts = scripted(monkeypatch, lambda epsilon, number: None if epsilon else 2)
    complete.step()
    assert counts == {0.0: 1, 0.1: 0}
    assert len(complete.links) == 2


def test_a_verified_chain_that_the_judge_refuses_has_to_pass_a_stricter_test(complete, monkeypatch):
    counts = scripted(monkeypatch, lambda epsilon, number: 1 if epsilon and number % 100 == 10 else None)
    complete.step()
    assert complete.done
    assert counts[0.1] == 100
    assert complete.refused()
    assert not complete.done
    again = PBCS(complete.trainer, complete.settings)
    again.restore(complete.snapshot())
    assert (again.refusals, again.verified, again.complete) == (1, False, True)
    middle = again.links[1]
    again.step()
    assert 110 < counts[0.1] <= 300
    assert (again.min_index, again.end) == (middle.start, middle.end)


def test_a_chain_that_was_never_verified_is_not_trained_on(trainer):
    method = PBCS(trainer, method_settings("pbcs", "thesis"))
    assert not method.refused()
    assert method.refusals == 0


def test_failures_are_counted_in_the_environment(complete):
    before = complete.trainer.counter.count
    found = complete._failures(complete.chain(3), 4, 0.1)
    assert len(found) == 4
    assert complete.trainer.counter.count > before


@pytest.mark.parametrize(("outcomes", "episodes", "rate"), [
    ([True] * 50, 50, 1.0), ([False] * 50, 50, 0.0), ([True] * 9 + [False] * 41, 10, 0.9),
    ([False] * 9 + [True] * 41, 10, 0.1), ([True] * 49 + [False], 50, 0.98)])
def test_a_test_stops_where_its_consequence_is_known(trainer, monkeypatch, outcomes, episodes, rate):
    left = list(outcomes)
    monkeypatch.setattr(SkillTrainer, "_tried",
                        lambda self, index, count: np.array([left.pop(0) for _ in range(count)]))
    assert trainer.test(trainer.waypoints.last - 1) == pytest.approx(rate)
    assert 50 - len(left) == episodes
