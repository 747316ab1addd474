"""Success rates and medians with their uncertainty."""

from collections.abc import Sequence

import numpy as np


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a success rate; (0, 1) when nothing was tried.

    Source: Wilson 1927, as in [Matheron2020] section 5.6.
    """
    if trials == 0:
        return 0.0, 1.0
    from scipy.stats import binomtest  # takes longer to load than all else that a worker process needs

    interval = binomtest(successes, trials).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def median_interval(values: Sequence[float], resamples: int = 2000) -> tuple[float, float]:
    """Return the 95 % percentile bootstrap interval of a median (Efron 1979); the same for the same values.

    Args:
        values: One at least.
        resamples: Of the values, with replacement.
    """
    drawn = np.random.default_rng(0).choice(np.asarray(values, dtype=np.float64), (resamples, len(values)))
    low, high = np.quantile(np.median(drawn, axis=1), (0.025, 0.975))
    return float(low), float(high)
