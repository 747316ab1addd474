"""The claims of the half-cheetah study on records whose truth is known, and its policy."""

from pathlib import Path

import numpy as np
import pytest

from pbcs_ompl.agents import Policy
from pbcs_ompl.experiments.study import find_study
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import read_arrays

STUDY = find_study("half-cheetah-priming")


def records(levels, seeds=6):
    """Records of 40 episodes that come to a level; the good policy has 1970 in every twentieth when there is one."""
    rng, rows = np.random.default_rng(0), []
    for name, level in levels.items():
        for seed in range(seeds):
            primed = [name.endswith("primed") and episode % 20 == 0 for episode in range(40)]
            returns = [1970.0 if one else max(0.0, level + 10.0 * rng.standard_normal()) for one in primed]
            rows.append({"variant": name, "seed": seed, "best": 2000.0, "returns": returns, "primed": primed,
                         "final": level})
    return rows


def verdicts(levels, seeds=6):
    study = find_study("half-cheetah-priming")
    study.analyse.__globals__["save"] = lambda figure, path: None
    return {claim.claim: claim for claim in study.analyse(records(levels, seeds), Path())}


def find(claims, words):
    (claim,) = [claim for text, claim in claims.items() if text.startswith(words)]
    return claim


THESIS = {"ddpg": 500.0, "ddpg-primed": 1200.0, "ddpg-argmax": 1800.0, "ddpg-argmax-primed": 1800.0}


def test_the_thesis_itself_agrees():
    claims = verdicts(THESIS)
    assert len(claims) == 7
    assert all(claim.agrees for claim in claims.values())


@pytest.mark.parametrize(("change", "words"), [
    ({"ddpg": 1900.0}, "DDPG-argmax outperforms DDPG (mean"),
    ({"ddpg-primed": 100.0}, "DDPG does better with priming"),
    ({"ddpg-primed": 1990.0}, "with priming, too, DDPG-argmax outperforms"),
    ({"ddpg-argmax-primed": 1000.0}, "priming does not change DDPG-argmax"),
    ({"ddpg-primed": 1990.0}, "with priming DDPG does not solve it"),
    ({"ddpg": -100.0}, "without priming"),
])
def test_each_claim_can_fail(change, words):
    assert find(verdicts(THESIS), words).agrees
    assert not find(verdicts(THESIS | change), words).agrees


def test_the_good_policys_episodes_are_not_the_actors():
    claim = find(verdicts(THESIS), "DDPG does better with priming")
    assert claim.numbers["ddpg-primed"]["mean"] == pytest.approx(1200.0, abs=10.0)


def test_one_seed_tells_no_interval():
    claim = find(verdicts(THESIS, seeds=1), "priming does not change")
    assert claim.agrees is None


def test_runs_go_seed_by_seed():
    names = [settings["name"] for settings in STUDY.runs(STUDY.sweep, 2)]
    assert names[:4] == [f"{variant}-0" for variant in STUDY.sweep["variants"]]
    assert len(set(names)) == 8


def test_the_good_policy_runs_fast_from_the_start():
    model = make("pbcs/SparseHalfCheetah-v0", {"threads": 1})
    policy = Policy.from_arrays(read_arrays(STUDY.folder / "expert.npz"))
    state, rewards = model.initial_state(0)[None], []
    for _ in range(100):
        outcome = model.transition(state, policy.act(model.observe(state)))
        state = outcome.states
        rewards.append(outcome.rewards[0])
    assert np.mean(rewards) > 1.6
