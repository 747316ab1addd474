"""The claims of the studies of settings (pbcs-ablation, ex-settings, presets) on records whose truth is known."""

from pathlib import Path

import pytest

from pbcs_ompl.experiments.claims import greater
from pbcs_ompl.experiments.study import find_study

USUAL = {"alpha": 3, "beta": 50, "radius": 0.1}
VALUES = {"alpha": [1, 3, 10], "beta": [5, 50, 100], "radius": [0.05, 0.1, 0.2]}
SEEDS = range(10)


def analysed(name, records):
    """The claims by their sentences, and the names of the figures, which are not rendered."""
    study, figures = find_study(name), []
    study.analyse.__globals__["save"] = lambda figure, path: figures.append(path.name)
    return {claim.claim: claim for claim in study.analyse(records, Path())}, figures


def verdicts(name, records):
    return analysed(name, records)[0]


def find(claims, words):
    (claim,) = [claim for text, claim in claims.items() if words in text]
    return claim


def ablation(numbers, seeds=SEEDS):
    """Records of every value; `numbers` says what differs from a solved run of 1000 transitions and 5 skills."""
    usual = {"solved": True, "success_rate": 1.0, "train_transitions": 1000, "skills": 5, "stalled": None}
    return [{"size": 3, "seed": seed, "usual": USUAL, "point": USUAL | {parameter: value}, **usual,
             **numbers.get((parameter, value), {})}
            for parameter, values in VALUES.items() for value in values for seed in seeds
            if value != USUAL[parameter] or parameter == "alpha"]


EXPENSIVE, LONG, BAD = {"train_transitions": 9000}, {"skills": 9}, {"solved": False, "success_rate": 0.5}


def test_an_ablation_as_the_thesis_expects_it():
    claims, figures = analysed("pbcs-ablation", ablation({
        ("alpha", 10): EXPENSIVE, ("alpha", 1): LONG, ("beta", 100): EXPENSIVE, ("beta", 5): BAD,
        ("radius", 0.05): EXPENSIVE | LONG}))
    assert len(claims) == 8
    assert {text: claim.agrees for text, claim in claims.items()} == dict.fromkeys(claims, True)
    assert find(claims, "beta = 5").numbers["success with random actions, median, 5"] == 0.5
    assert set(figures) == {f"{parameter}-{what}.png" for parameter in VALUES
                            for what in ("solved", "train-transitions", "skills")}


def test_an_ablation_that_shows_the_opposite():
    claims = verdicts("pbcs-ablation", ablation({
        ("alpha", 10): BAD, ("alpha", 3): EXPENSIVE | LONG, ("beta", 100): BAD,
        ("radius", 0.2): LONG}))
    assert {text: claim.agrees for text, claim in claims.items()} == dict.fromkeys(claims, False)


def test_incomplete_chains_do_not_count_as_short_ones():
    numbers = {("alpha", 1): LONG | {"stalled": "the budget is used up"}}
    assert find(verdicts("pbcs-ablation", ablation(numbers)), "alpha = 1 ").agrees is None


def test_every_value_of_the_ablation_is_run_once():
    study = find_study("pbcs-ablation")
    points = [tuple(one["point"].items()) for one in study.runs(study.sweep, 1) if one["size"] == 3]
    assert len(points) == len(set(points)) == 1 + sum(len(values) - 1 for values in study.sweep["values"].values())


def searches(costs, scene="maze", seeds=SEEDS):
    """Records of searches; `costs` has the transitions for each option and value."""
    return [{"scene": scene, "option": option, "value": value, "seed": seed, "suggested": 0.15, "solved": True,
             "transitions": cost + seed, "seconds": cost / 1e6} for (option, value), cost in costs.items()
            for seed in seeds]


def test_settings_of_ex_as_we_recommend_them():
    costs = {("bin_size", 0.15): 1000, ("bin_size", 0.5): 900, ("bin_size", 1.0): 5000, ("batch", 1): 1000,
             ("batch", 256): 7000}
    claims = verdicts("ex-settings", searches(costs))
    assert len(claims) == 5
    assert {text: claim.agrees for text, claim in claims.items()} == dict.fromkeys(claims, True)


def test_settings_of_ex_that_are_wrong():
    records = searches({("bin_size", 0.15): 2000, ("bin_size", 1.0): 1000, ("batch", 1): 1000, ("batch", 256): 500})
    records[0] |= {"solved": False}
    claims = verdicts("ex-settings", records)
    assert {text: claim.agrees for text, claim in claims.items()} == dict.fromkeys(claims, False)
    assert find(claims, "every value").numbers["failures"] == {"maze, bin_size 0.15": 1}


def trainings(fast, thesis, seeds=SEEDS):
    return [{"preset": preset, "size": 2, "seed": seed, "max_transitions": 300_000, "stalled": None, **numbers}
            for preset, numbers in (("fast", fast), ("thesis", thesis)) for seed in seeds]


CHEAP, DEAR = {"transitions": 50_000, "cpu_seconds": 0.5}, {"transitions": 300_000, "cpu_seconds": 100.0}


def test_a_preset_that_is_worth_its_name():
    claims = verdicts("presets", [*trainings(CHEAP | {"solved": True}, DEAR | {"solved": False}),
                                  *trainings(CHEAP | {"solved": True}, DEAR | {"solved": True}, seeds=[10])])
    assert {text: claim.agrees for text, claim in claims.items()} == dict.fromkeys(claims, True)
    assert len(claims) == 4


def test_a_preset_that_is_not():
    claims = verdicts("presets", trainings(DEAR | {"solved": True}, CHEAP | {"solved": False}))
    assert {text: claim.agrees for text, claim in claims.items() if "more mazes" not in text} == {
        text: False for text in claims if "more mazes" not in text}
    assert find(claims, "more mazes").agrees is True


def test_presets_of_which_one_has_not_run_are_not_compared():
    records = [record for record in trainings(CHEAP | {"solved": True}, DEAR) if record["preset"] == "fast"]
    assert {claim.agrees for claim in verdicts("presets", records).values()} == {None}


@pytest.mark.parametrize(("first", "second", "agrees"), [
    ({seed: 2.0 + seed for seed in range(5)}, {seed: 1.0 for seed in range(5)}, True),
    ({seed: 1.0 for seed in range(5)}, {seed: 2.0 + seed for seed in range(5)}, False),
    ({seed: 1.0 for seed in range(5)}, {seed: 1.0 for seed in range(5)}, False),
    ({seed: 2.0 for seed in range(4)}, {seed: 1.0 for seed in range(9)}, None),
    ({}, {}, None)])
def test_greater_pairs_what_both_have(first, second, agrees):
    claim = greater("one is greater", first, second, ("one", "other"), "here")
    assert claim.agrees is agrees
    assert claim.numbers["greater"]["n"] == len(first)
    assert bool(claim.note) == (agrees is None)
