"""Wald's sequential probability ratio test: as many trials as the answer needs, with stated error rates."""

from dataclasses import dataclass, replace
from math import ceil, log
from typing import Self

from pbcs_ompl.skills.settings import Settings


@dataclass(frozen=True)
class SequentialTest(Settings):
    """Whether a success rate is at least `accepted_rate` rather than at most `refused_rate`.

    After k successes in n trials the log of the likelihood ratio of the two rates p1 > p0 is

        k log(p1 / p0) + (n - k) log((1 - p1) / (1 - p0));

    the rate is accepted above log((1 - false_refusals) / false_acceptances) and refused below
    log(false_refusals / (1 - false_acceptances)). After `most_trials` the sign decides.

    Attributes:
        refused_rate: p0 (ours: a little below what counts as solved, see `CriterionSettings.robust_rate`, since a test
            that refuses a good policy costs as much as its training; with p1 it accepts 50 successes in a row, and one
            failure in 100).
        accepted_rate: p1 (ours: a policy of this rate misses 95 of 100 in one case of many thousands).
        false_acceptances: Chance to accept p0 (ours, not tuned).
        false_refusals: Chance to refuse p1 (ours, not tuned).
        most_trials: Trials after which the sign decides, so that rates in between do not cost more (ours).

    Source: A. Wald, Sequential Tests of Statistical Hypotheses, 1945.
    """

    refused_rate: float = 0.94
    accepted_rate: float = 0.998
    false_acceptances: float = 0.05
    false_refusals: float = 0.05
    most_trials: int = 100

    def _check_ranges(self) -> None:
        self._check("greater than 0 and less than 1", lambda value: 0 < value < 1, "refused_rate", "accepted_rate")
        self._check("greater than 0 and less than 0.5", lambda value: 0 < value < 0.5, "false_acceptances",
                    "false_refusals")
        self._check("greater than refused_rate", lambda value: value > self.refused_rate, "accepted_rate")
        self._check_counts("most_trials")

    def with_failures(self, factor: float) -> Self:
        """Return the test of rates whose failures are `factor` times as frequent; it takes as many fewer trials."""
        return replace(self, refused_rate=1.0 - factor * (1.0 - self.refused_rate),
                       accepted_rate=1.0 - factor * (1.0 - self.accepted_rate),
                       most_trials=ceil(self.most_trials / factor))

    def verdict(self, successes: int, trials: int) -> bool | None:
        """Return whether the rate is accepted; None while more trials are needed.

        It is refused as soon as successes alone until `most_trials` would not change that.
        """
        ratio = self._ratio(successes, trials)
        if ratio >= self._acceptance:
            return True
        left = self.most_trials - trials
        if ratio <= log(self.false_refusals / (1 - self.false_acceptances)) or (
                self._ratio(successes + left, self.most_trials) <= 0):
            return False
        return None if left > 0 else True

    def most_needed(self, successes: int, trials: int) -> int:
        """Return after how many further trials, all of them successes, there is a verdict."""
        missing = (self._acceptance - self._ratio(successes, trials)) / log(self.accepted_rate / self.refused_rate)
        return min(max(1, ceil(missing)), self.most_trials - trials)

    @property
    def _acceptance(self) -> float:
        return log((1 - self.false_refusals) / self.false_acceptances)

    def _ratio(self, successes: int, trials: int) -> float:
        """Return the log of the likelihood ratio of the two rates."""
        return (successes * log(self.accepted_rate / self.refused_rate)
                + (trials - successes) * log((1 - self.accepted_rate) / (1 - self.refused_rate)))
