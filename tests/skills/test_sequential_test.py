"""Wald's test: its verdicts, and its error rates by simulation."""

from math import log

import numpy as np
import pytest

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.skills.sequential_test import SequentialTest

TEST = SequentialTest(refused_rate=0.8, accepted_rate=0.95, false_acceptances=0.05, false_refusals=0.1,
                      most_trials=10_000)


def decided(test: SequentialTest, rate: float, rng: np.random.Generator) -> tuple[bool, int]:
    successes, trials, verdict = 0, 0, None
    while verdict is None:
        successes += rng.random() < rate
        trials += 1
        verdict = test.verdict(successes, trials)
    return verdict, trials


def test_errors_are_at_most_those_that_are_stated() -> None:
    rng = np.random.default_rng(0)
    accepted = np.mean([decided(TEST, 0.8, rng)[0] for _ in range(1000)])
    refused = 1.0 - np.mean([decided(TEST, 0.95, rng)[0] for _ in range(1000)])
    assert accepted <= 0.05 + 0.02
    assert refused <= 0.1 + 0.03


def test_clear_cases_take_fewer_trials_than_close_ones() -> None:
    rng = np.random.default_rng(1)
    clear = np.mean([decided(TEST, 0.3, rng)[1] for _ in range(100)])
    close = np.mean([decided(TEST, 0.88, rng)[1] for _ in range(100)])
    assert clear * 3 < close


def test_more_successes_never_turn_an_acceptance_into_a_refusal() -> None:
    order = {False: 0, None: 1, True: 2}
    for trials in (1, 10, 44, 100):
        verdicts = [order[SequentialTest().verdict(successes, trials)] for successes in range(trials + 1)]
        assert verdicts == sorted(verdicts)
        assert verdicts[0] < verdicts[-1] or trials == 1


def test_where_failures_are_more_frequent_fewer_trials_suffice() -> None:
    test, stressed = SequentialTest(accepted_rate=0.993), SequentialTest(accepted_rate=0.993).with_failures(3.0)
    assert 1.0 - stressed.refused_rate == pytest.approx(3.0 * 0.06)
    assert 1.0 - stressed.accepted_rate == pytest.approx(3.0 * 0.007)
    assert test.with_failures(1.0).most_needed(0, 0) == test.most_needed(0, 0) == 54
    assert (stressed.most_needed(0, 0), stressed.most_trials) == (17, 34)
    rng = np.random.default_rng(2)
    assert np.mean([decided(stressed, stressed.refused_rate, rng)[0] for _ in range(1000)]) <= 0.05 + 0.02
    assert np.mean([decided(stressed, stressed.accepted_rate, rng)[0] for _ in range(1000)]) >= 0.95 - 0.02
    with pytest.raises(InvalidOption, match="refused_rate"):
        test.with_failures(20.0)


def test_it_ends_with_the_most_trials() -> None:
    test = SequentialTest(refused_rate=0.93, accepted_rate=0.995, most_trials=50)
    assert all(test.verdict(successes, 50) is not None for successes in range(51))
    assert test.verdict(30, 30) is None


def test_it_refuses_as_soon_as_successes_alone_would_not_be_accepted() -> None:
    """It never takes a trial that cannot change the verdict."""
    test = SequentialTest()
    for failures in range(4):
        for successes in range(test.most_trials - failures + 1):
            trials = successes + failures
            ahead = [test.verdict(successes + more, trials + more) for more in range(test.most_trials - trials + 1)]
            if ahead[0] is None:
                assert True in ahead
                assert ahead.index(True) == test.most_needed(successes, trials)
            elif test._ratio(successes, trials) > log(0.05 / 0.95):  # Wald's bound does not refuse
                assert len(set(ahead)) == 1


def test_rates_have_an_order_and_errors_a_range() -> None:
    for changes in ({"refused_rate": 0.99, "accepted_rate": 0.9}, {"accepted_rate": 1.0}, {"false_refusals": 0.5},
                    {"most_trials": 0}):
        with pytest.raises(InvalidOption):
            SequentialTest(**changes)
