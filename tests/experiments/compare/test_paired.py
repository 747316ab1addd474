"""Laws of the paired tests: fair to both sides, blind to what censoring hides, corrected for their number."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from pbcs_ompl.experiments.planner_statistics import holm, sign_tests
from pbcs_ompl.experiments.planning_run import Job, broken

BUDGET = 100


def records(outcomes):
    """Return a record for each seed: solved with so many transitions, or None for unsolved."""
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
    job = Job("1-Maze-v0/C-0", "C", 0, "env", {}, {}, BUDGET, None)
    runs = {"A": records([1, 2, 3]), "B": records([2, 3, 4])[::-1], "C": [broken(job, "no constructor")]}
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
