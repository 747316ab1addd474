"""Wald's sequential probability ratio test: as many trials as the answer needs, with stated error rates."""

from dataclasses import dataclass
from math import log

from pbcs_ompl.skills.settings import Settings


@dataclass(frozen=True)
class SequentialTest(Settings):
    """Whether a success rate is at least `accepted_rate` rather than at most `refused_rate`.

    After k successes in n trials the log of the likelihood ratio of the two rates p1 > p0 is

        k log(p1 / p0) + (n - k) log((1 - p1) / (1 - p0));

    the rate is accepted above log((1 - false_refusals) / false_acceptances) and refused below
    log(false_refusals / (1 - false_acceptances)). After `most_trials` the sign decides.

    Attributes:
        refused_rate: p0 (ours: what counts as solved, see `CriterionSettings.robust_rate`).
        accepted_rate: p1 (ours: a policy of this rate fails 95 of 100 in one case of thousands).
        false_acceptances: Chance to accept p0 (ours, not tuned).
        false_refusals: Chance to refuse p1 (ours, not tuned).
        most_trials: Trials after which the sign decides, so that rates in between do not cost more (ours).

    Source: A. Wald, Sequential Tests of Statistical Hypotheses, 1945.
    """

    refused_rate: float = 0.95
    accepted_rate: float = 0.995
    false_acceptances: float = 0.05
    false_refusals: float = 0.05
    most_trials: int = 100

    def _check_ranges(self) -> None:
        self._check("greater than 0 and less than 1", lambda value: 0 < value < 1, "refused_rate", "accepted_rate")
        self._check("greater than 0 and less than 0.5", lambda value: 0 < value < 0.5, "false_acceptances",
                    "false_refusals")
        self._check("greater than refused_rate", lambda value: value > self.refused_rate, "accepted_rate")
        self._check_counts("most_trials")

    def verdict(self, successes: int, trials: int) -> bool | None:
        """Return whether the rate is accepted; None while more trials are needed."""
        failures = trials - successes
        ratio = (successes * log(self.accepted_rate / self.refused_rate)
                 + failures * log((1 - self.accepted_rate) / (1 - self.refused_rate)))
        if ratio >= log((1 - self.false_refusals) / self.false_acceptances):
            return True
        if ratio <= log(self.false_refusals / (1 - self.false_acceptances)):
            return False
        return None if trials < self.most_trials else ratio > 0
