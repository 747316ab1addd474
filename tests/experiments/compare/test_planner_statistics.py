"""Laws of the numbers of a comparison: censored medians, intervals that contain the rate, tests fair to both sides."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from pbcs_ompl.experiments.planner_statistics import holm, planner_row, sign_tests
from pbcs_ompl.experiments.planning_run import failed_record
from pbcs_ompl.experiments.run import Failure, Run

RUN = Run("1-Maze-v0/P-0", {"planner": "P", "seed": 0, "environment": {"id": "env"}})
BUDGET = 100


def failed(reason):
    return failed_record(RUN, Failure(reason))


def record(solved, transitions=10, seconds=1.0):
    return {**failed(""), "solved": solved, "transitions": transitions, "seconds": seconds, "reason": None,
            "collision_checks": 2 * transitions, "path_length": 5 if solved else None, "coverage": 0.5}


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 1000)), min_size=1, max_size=20))
def test_rows_hold_together(runs):
    summary = planner_row("P", [record(solved, transitions) for solved, transitions in runs], 1000)
    low, high = summary["wilson"]
    assert 0 <= low <= summary["solved"] / summary["runs"] <= high <= 1
    first, third = summary["transitions_quartiles"]
    assert first <= summary["transitions_median"] <= third <= 1000
    if 2 * summary["solved"] < len(runs):
        assert summary["transitions_median"] == 1000
    assert summary["path_length_median"] == (5 if summary["solved"] else None)


def test_unsolved_runs_count_as_the_whole_budget():
    runs = [record(True, 100), record(True, 300), record(False, 500)]
    assert planner_row("P", runs, 1000)["transitions_median"] == 300
    assert planner_row("P", [*runs, record(False, 500)], 1000)["transitions_median"] == 650
    assert planner_row("P", runs, 1000)["collision_checks_median"] == 600


def test_failed_runs_have_no_seconds_and_say_why():
    summary = planner_row("P", [failed("first\nreason"), failed("second")], 1000)
    assert (summary["failed"], summary["reason"], summary["transitions_median"], summary["seconds_median"]) == \
        (2, "first reason", None, None)
    mixed = planner_row("P", [failed("why"), record(True, 10, 2.0)], 1000)
    assert (mixed["failed"], mixed["seconds_median"], mixed["transitions_median"], mixed["reason"]) == \
        (1, 2.0, 505.0, "why")


def records(outcomes):
    """Return a record for each seed: solved with this many transitions, or None for unsolved."""
    return [{"seed": seed, "solved": needed is not None, "transitions": BUDGET if needed is None else needed,
             "seconds": 1.0} for seed, needed in enumerate(outcomes)]


outcome = st.one_of(st.none(), st.integers(1, BUDGET - 1))
pairs = st.lists(st.tuples(outcome, outcome), min_size=1, max_size=30)


@given(pairs)
def test_neither_side_is_favoured_and_unsolved_is_worst(outcomes):
    one, other = (records(side) for side in zip(*outcomes, strict=True))
    (test,), (turned,) = (sign_tests(runs, BUDGET) for runs in ({"A": one, "B": other}, {"B": other, "A": one}))
    assert (test["p"], test["fewer"], test["ties"]) == (turned["p"], turned["fewer"][::-1], turned["ties"])
    assert sum(test["fewer"]) + test["ties"] == len(outcomes)
    wins = sum(a is not None and (b is None or a < b) for a, b in outcomes)
    assert test["fewer"][0] == wins
    decided = sum(test["fewer"])
    assert test["p"] == (binomtest(wins, decided).pvalue if decided else 1.0)


@given(pairs)
def test_only_the_order_within_a_pair_matters(outcomes):
    """How far apart two solved runs are, and how large the budget is, changes nothing."""
    one, other = (records(side) for side in zip(*outcomes, strict=True))
    test = sign_tests({"A": one, "B": other}, BUDGET)
    stretched = [[{**record, "transitions": record["transitions"] ** 3} for record in side] for side in (one, other)]
    assert sign_tests({"A": stretched[0], "B": stretched[1]}, BUDGET ** 3) == test


def test_seeds_are_paired_whatever_their_order_and_planners_that_never_ran_are_left_out():
    runs = {"A": records([1, 2, 3]), "B": records([2, 3, 4])[::-1], "C": [failed("no constructor")]}
    assert [(test["planners"], test["fewer"]) for test in sign_tests(runs, BUDGET)] == [(["A", "B"], [3, 0])]


@given(st.lists(st.floats(0, 1), max_size=20))
def test_holm_rejects_what_the_stepwise_procedure_rejects(chances):
    corrected = holm(chances)
    assert all(before <= after <= 1 for before, after in zip(chances, corrected, strict=True))
    for level in (0.01, 0.05, 0.5):
        rejected = [False] * len(chances)
        for step, place in enumerate(np.argsort(chances, kind="stable")):
            if chances[place] * (len(chances) - step) > level:
                break
            rejected[place] = True
        assert [value <= level for value in corrected] == rejected


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
