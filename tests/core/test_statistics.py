"""Intervals are those of a statistics library, which takes longer to load than they do to compute."""

import pytest
from scipy.stats import binomtest

from pbcs_ompl.core.statistics import wilson


def test_the_interval_of_a_rate_is_wilsons() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
    for trials in (1, 2, 3, 7, 20, 100, 448):
        for successes in range(trials + 1):
            expected = binomtest(successes, trials).proportion_ci(method="wilson")
            assert wilson(successes, trials) == pytest.approx((expected.low, expected.high), abs=1e-14)
            assert 0.0 <= wilson(successes, trials)[0] <= successes / trials <= wilson(successes, trials)[1] <= 1.0
