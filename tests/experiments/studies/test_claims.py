"""A claim agrees or differs only where its test could decide."""

import numpy as np
import pytest
from scipy.stats import fisher_exact

from pbcs_ompl.experiments import claims
from pbcs_ompl.experiments.claims import (
    APART,
    PAIRS,
    POWER,
    about,
    always,
    at_least,
    at_most,
    fewest_runs,
    greater,
    greater_apart,
    higher,
    never,
    no_higher,
    rate,
    sometimes,
)

NAMES = ("one", "other")


@pytest.mark.parametrize(("first", "second", "agrees"), [
    ((0, 2), (0, 2), None), ((1, 1), (0, 1), None), ((0, 10), (0, 10), None), ((10, 20), (9, 20), None),
    ((10, 10), (0, 10), True), ((0, 10), (10, 10), False), ((50, 100), (50, 100), False), ((0, 0), (0, 0), None)])
def test_rates_are_compared_where_runs_suffice(first, second, agrees):
    claim = higher("one is higher", rate(*first), rate(*second), NAMES, "here")
    assert claim.agrees is agrees
    assert ("not enough runs" in claim.note) == (agrees is None)
    opposite = no_higher("one is not higher", rate(*first), rate(*second), NAMES, "here")
    assert opposite.agrees is (None if agrees is None else not agrees)


def test_p_values_are_those_of_fishers_test():
    for first, second in (((7, 10), (2, 12)), ((0, 5), (5, 5)), ((3, 3), (3, 9))):
        table = [[first[0], first[1] - first[0]], [second[0], second[1] - second[0]]]
        p = higher("", rate(*first), rate(*second), NAMES, "").numbers["p uncorrected (Fisher)"]
        assert p == pytest.approx(fisher_exact(table, alternative="greater").pvalue, abs=1e-5)


@pytest.mark.parametrize("rates", [APART, (0.2, 0.02)])
def test_the_fewest_runs_have_the_power_that_is_claimed(rates):
    """By simulation: with this number of runs of each, the two rates are separated in four cases of five."""
    runs, rng = fewest_runs(*rates), np.random.default_rng(0)
    one, other = (rng.binomial(runs, chance, 1000) for chance in rates)
    shown = [higher("", rate(first, runs), rate(second, runs), NAMES, "").agrees for first, second in
             zip(one.tolist(), other.tolist(), strict=True)]
    assert np.mean([verdict is True for verdict in shown]) == pytest.approx(
        claims._power((runs, runs), rates), abs=0.04)
    assert claims._power((runs, runs), rates) >= POWER > claims._power((runs - 3, runs - 3), rates)


def test_closer_rates_need_more_runs_and_rates_of_a_source_are_the_measure():
    """0 of 25 beside 11 of 500 says nothing about 6 % against 1 %, though it would about 70 % against 30 %."""
    assert fewest_runs(0.06, 0.01) > 100 > fewest_runs(*APART) > fewest_runs(0.8, 0.2)
    few = higher("so", rate(0, 25), rate(11, 500), NAMES, "here", expected=(0.06, 0.01))
    assert few.agrees is None
    assert str(fewest_runs(0.06, 0.01)) in few.note
    assert higher("so", rate(3, 300), rate(11, 500), NAMES, "here", expected=(0.06, 0.01)).agrees is False


@pytest.mark.parametrize(("claim", "successes", "trials", "agrees"), [
    (always, 1, 1, None), (always, 34, 34, None), (always, 35, 35, True), (always, 2, 3, False), (always, 0, 0, None),
    (never, 0, 2, None), (never, 0, 35, True), (never, 1, 2, False), (never, 0, 0, None),
    (sometimes, 0, 2, None), (sometimes, 0, 35, False), (sometimes, 1, 2, True)])
def test_one_case_decides_against_always_and_never_and_a_few_do_not_decide_for_them(claim, successes, trials, agrees):
    assert claim("so", "rate", rate(successes, trials), "here").agrees is agrees


@pytest.mark.parametrize(("successes", "trials", "above", "below"), [
    (1, 1, None, None), (4, 4, True, False), (0, 4, False, True), (12, 20, None, None), (60, 80, True, False)])
def test_a_bar_lies_outside_of_the_interval_or_nothing_is_said(successes, trials, above, below):
    found = rate(successes, trials)
    assert at_least("so", "rate", found, 0.5, "here").agrees is above
    assert at_most("so", "rate", found, 0.5, "here").agrees is below


@pytest.mark.parametrize(("successes", "trials", "agrees"), [
    (0, 25, None), (6, 600, True), (60, 600, False), (0, 2000, True)])
def test_a_rate_is_near_a_number_when_its_whole_interval_is(successes, trials, agrees):
    assert about("so", "rate", rate(successes, trials), 0.01, 0.015, "here").agrees is agrees


def test_numbers_that_are_no_pairs():
    high, low = list(range(10, 10 + PAIRS)), list(range(PAIRS))
    assert greater_apart("so", high, low, NAMES, "here").agrees is True
    assert greater_apart("so", low, high, NAMES, "here").agrees is False
    assert greater_apart("so", low, low, NAMES, "here").agrees is False
    assert greater_apart("so", low[:3], low[:3], NAMES, "here").agrees is None
    assert greater_apart("so", [], low, NAMES, "here").agrees is None


def test_the_fewest_pairs_detect_what_nine_of_ten_have():
    rng, shown = np.random.default_rng(1), []
    for _ in range(300):
        signs = np.where(rng.random(PAIRS) < 0.9, 1.0, -1.0) * rng.uniform(0.9, 1.1, PAIRS)
        shown.append(greater("so", dict(enumerate(signs)), dict.fromkeys(range(PAIRS), 0.0), NAMES, "here").agrees)
    assert np.mean([verdict is True for verdict in shown]) >= POWER
