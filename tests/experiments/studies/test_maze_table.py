"""The claims of the maze table on records whose truth is known."""

from pathlib import Path

import pytest

from pbcs_ompl.experiments.studies.maze_table import analysis
from pbcs_ompl.experiments.study import find_study

STUDY = find_study("maze-table")
SIZES = (2, 3, 4, 5, 7, 10, 15)


def record(label, size, index, solved, *, cost=100_000, skills=1):
    return {"label": label, "size": size, "index": index, "seed": 500 + index, "solved": solved, "succeeds": solved,
            "transitions": cost, "skills": skills, "complete": True, "reason": None, "max_transitions": 1_000_000,
            "success_rate": float(solved), "nominal_success_rate": float(solved)}


def table(pbcs, pb, ddpg, td3, *, follow=lambda *_: True, follow_cost=30_000, **options):
    """Records of ten seeds a size, and of as many of PBCS as its bars need.

    Each method is a function of size and index that says whether it is solved.
    """
    methods = {"PBCS": pbcs, "PB": pb, "DDPG": ddpg, "TD3": td3}
    followed = [record("Follow", size, index, follow(size, index), cost=follow_cost)
                for size in SIZES for index in range(10)]
    return followed + [record(label, size, index, solves(size, index), skills=size, **options)
            for label, solves in methods.items() for size in SIZES
            for index in range(10 if label != "PBCS" else 80 if size < 10 else 20)]


@pytest.fixture
def verdicts(monkeypatch):
    """Return the claims on some records by their sentences; nothing is drawn."""
    monkeypatch.setattr(analysis, "publish", lambda figure, path: None)
    return lambda records: {claim.claim: claim for claim in analysis.analyse(records, Path())}


def find(claims, words):
    (claim,) = [claim for text, claim in claims.items() if words in text]
    return claim


def test_a_world_as_the_thesis_describes_it(verdicts):
    records = table(lambda size, _: True, lambda size, index: size == 2 and index < 7,
                    lambda size, index: size == 2 and index < 1, lambda size, index: size == 2 and index < 1)
    claims = verdicts(records)
    assert len(claims) == 15
    assert {text: claim.agrees for text, claim in claims.items()} == dict.fromkeys(claims, True)
    compared = find(claims, "PBCS solves more mazes than PB (").numbers
    assert compared["only PBCS, only PB"] == [63, 0]


def test_the_opposite_world(verdicts):
    records = table(lambda size, index: size < 4 and index < 9, lambda size, _: True, lambda size, _: size > 2,
                    lambda size, _: size > 2, follow=lambda size, index: size < 4 and index < 3, follow_cost=50_000)
    claims = verdicts(records)
    unlike = {"PB solves 2x2 mazes more often", "PBCS chains more skills"}
    too_few = {"DDPG alone solves some 2x2", "TD3 alone solves some 2x2", "PB regularly fails"}  # ten runs of each
    for text, claim in claims.items():
        expected = None if text.startswith(tuple(too_few)) else text.startswith(tuple(unlike))
        assert claim.agrees is expected, text


def test_a_chain_that_took_more_than_the_others_had_is_not_held_against_them(verdicts):
    claims = verdicts(table(lambda *_: True, lambda *_: False, lambda *_: False, lambda *_: False, cost=1_000_001))
    for label in ("PB", "DDPG", "TD3"):
        claim = find(claims, f"PBCS solves more mazes than {label} (")
        assert claim.agrees is False
        assert claim.numbers["PBCS"]["successes"] == 0
    assert find(claims, "95% of the mazes").agrees is True


def test_four_runs_without_success_do_not_show_that_there_is_none(verdicts):
    records = [record(label, 2, index, False) for label in ("PBCS", "PB", "DDPG", "TD3") for index in range(4)]
    claims = verdicts(records)
    assert {text for text, claim in claims.items() if claim.agrees is not None} == {
        text for text in claims if "95% of the mazes" in text or "PB regularly fails" in text}
    assert find(verdicts([*records, record("TD3", 2, 4, True)]), "TD3 alone solves some").agrees is True


def test_pbcs_runs_first_and_then_the_others_in_balance():
    settings = STUDY.runs(STUDY.sweep, 20)
    labels = [one["label"] for one in settings]
    assert len(settings) == 2 * (100 + 40 + 5 + 3) + 2 * (7 * 10 + 5 + 3) + 9 * 3 + 4 * 10 + 5 + 3
    assert set(labels[:148]) == {"PBCS"}
    assert [(one["label"], one["size"]) for one in settings[148:184]] == [
        (label, size) for size in (*SIZES, 20, 30) for label in ("Follow", "PB", "DDPG", "TD3")]
    assert {one["seed"] for one in settings[148:184]} == {500}
    assert {one["planner"] for one in settings if one["label"] == "Follow"} == {"Rides"}


@pytest.mark.parametrize("label", ["PBCS", "TD3"])
def test_the_first_seed_is_drawn(label, tmp_path):
    pictured = record(label, 2, 0, True) | {
        "env_kwargs": {"size": 2}, "plan": None if label == "TD3" else [[0.5, 0.5], [1.5, 1.0], [0.5, 1.5]],
        "rollout": [[0.5, 0.5], [1.5, 1.0], [0.5, 1.5]], "activations": [[[0.5, 0.5], 0.1]]}
    STUDY.analyse([pictured], tmp_path)
    assert (tmp_path / "mazes.png").stat().st_size > 5000
    assert (tmp_path / "chains.png").is_file() == (label == "PBCS")


def test_the_literal_algorithm_has_its_own_row_and_says_where_it_stops(verdicts):
    runs = [run.settings for run in STUDY.all_runs()]
    literal = [one for one in runs if one["label"] == analysis.LITERAL]
    assert {one["preset"] for one in literal} == {"thesis"}
    assert literal == runs[-len(literal):], "the runs that take long come last"
    assert [sum(one["size"] == size for one in literal) for size in (5, 7, 10, 15)] == [10, 5, 3, 0]
    stopped = record(analysis.LITERAL, 3, 0, False) | {"complete": False, "reason": "the budget is used up"}
    claims = verdicts([stopped, record(analysis.LITERAL, 2, 0, True), record("PBCS", 3, 0, True)])
    assert find(claims, "to the letter").numbers["where it stops"] == {"the budget is used up": 1}
