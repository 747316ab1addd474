"""Success rates and medians with their uncertainty."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

QUANTILE = NormalDist().inv_cdf(0.975)


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a success rate; (0, 1) when nothing was tried.

    The ends are (2 k + z^2 -+ z sqrt(4 k (n - k) / n + z^2)) / (2 (n + z^2)) for k of n. Source: Wilson 1927, as in
    [Matheron2020] section 5.6; written here because `scipy.stats` takes half as long to load as a short training.
    """
    if trials == 0:
        return 0.0, 1.0
    squared = QUANTILE**2
    scale = 2.0 * (trials + squared)
    failures = trials - successes
    centre = (2.0 * successes + squared) / scale
    half = QUANTILE / scale * math.sqrt(4.0 * successes * failures / trials + squared)
    return centre - half if successes else 0.0, centre + half if failures else 1.0


def median_interval(values: Sequence[float], resamples: int = 2000) -> tuple[float, float]:
    """Return the 95 % percentile bootstrap interval of a median (Efron 1979); the same for the same values.

    Args:
        values: One at least.
        resamples: Of the values, with replacement.
    """
    drawn = np.random.default_rng(0).choice(np.asarray(values, dtype=np.float64), (resamples, len(values)))
    low, high = np.quantile(np.median(drawn, axis=1), (0.025, 0.975))
    return float(low), float(high)
