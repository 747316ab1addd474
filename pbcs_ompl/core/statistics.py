"""Success rates with their uncertainty."""


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a success rate; (0, 1) when nothing was tried.

    Source: Wilson 1927, as in [Matheron2020] section 5.6.
    """
    if trials == 0:
        return 0.0, 1.0
    from scipy.stats import binomtest  # takes longer to load than all else that a worker process needs

    interval = binomtest(successes, trials).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)
