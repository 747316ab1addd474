"""What a study claims, and whether its data agree."""

from collections.abc import Hashable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

import numpy as np
from scipy.stats import wilcoxon

from pbcs_ompl.core.statistics import wilson

Key = TypeVar("Key", bound=Hashable)
SIGNIFICANCE = 0.05
FEWEST_PAIRS = 5
"""With fewer pairs even the clearest difference has a p-value above 0.05."""


@dataclass(frozen=True)
class Claim:
    """A sentence that is true or false of the data.

    Attributes:
        claim: The sentence, with the condition that was checked.
        agrees: Whether the data agree; None when they cannot decide.
        numbers: The numbers that decide, with their N; see `rate`.
        source: Where the claim comes from.
        note: An explanation, if there is one.
    """

    claim: str
    agrees: bool | None
    numbers: dict[str, Any] = field(default_factory=dict)
    source: str = ""
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self) | {"agrees": None if self.agrees is None else bool(self.agrees)}


def rate(successes: int, trials: int) -> dict[str, Any]:
    """Return {"successes", "n", "rate", "wilson"}: a rate, None without trials, and its 95 % Wilson interval."""
    successes, trials = int(successes), int(trials)
    return {"successes": successes, "n": trials, "rate": successes / trials if trials else None,
            "wilson": list(wilson(successes, trials))}


def greater(claim: str, first: Mapping[Key, float], second: Mapping[Key, float], names: tuple[str, str],
            source: str, note: str = "") -> Claim:
    """Claim that the first numbers are greater, by Wilcoxon's one-sided signed-rank test over the keys both have.

    Args:
        claim: The sentence; the condition is added.
        first, second: A number for each seed, or whatever else pairs them.
        names: What to call the two.
        source: Where the claim comes from.
        note: An explanation.
    """
    keys = [key for key in first if key in second]
    one, other = np.array([first[key] for key in keys]), np.array([second[key] for key in keys])
    enough = len(keys) >= FEWEST_PAIRS
    test: Any = wilcoxon(one, other, alternative="greater") if enough and (one != other).any() else None
    p = 1.0 if test is None else float(test.pvalue)
    medians = {f"median, {name}": float(np.median(values)) if keys else None
               for name, values in zip(names, (one, other), strict=True)}
    return Claim(f"{claim} (p < {SIGNIFICANCE})", p < SIGNIFICANCE if enough else None,
                 {**medians, "greater": rate((one > other).sum() if keys else 0, len(keys)),
                  "p uncorrected (Wilcoxon)": p},
                 source, note if enough else f"fewer than {FEWEST_PAIRS} pairs: no test can decide")
