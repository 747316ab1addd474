"""A claim that one number is greater than another, seed by seed."""

from collections.abc import Hashable, Mapping

import numpy as np
from scipy.stats import wilcoxon

from pbcs_ompl.experiments.study.claims import Claim, rate

SURE = 0.05
FEWEST = 5
"""With fewer pairs even the clearest difference has a p-value above 0.05."""


def greater(claim: str, first: Mapping[Hashable, float], second: Mapping[Hashable, float], names: tuple[str, str],
            source: str, note: str = "") -> Claim:
    """Claim that the first numbers are greater, by Wilcoxon's one-sided signed-rank test over the keys both have.

    Args:
        claim: The sentence; the condition is added.
        first, second: A number for each seed, or whatever else pairs them.
        names: What to call the two.
        source: Where the claim comes from.
        note: A look at why.
    """
    keys = [key for key in first if key in second]
    one, other = np.array([first[key] for key in keys]), np.array([second[key] for key in keys])
    told = len(keys) >= FEWEST
    chance = float(wilcoxon(one, other, alternative="greater").pvalue) if told and (one != other).any() else 1.0
    medians = {f"median, {name}": float(np.median(values)) if keys else None
               for name, values in zip(names, (one, other), strict=True)}
    return Claim(f"{claim} (p < {SURE})", chance < SURE if told else None,
                 {**medians, "greater": rate((one > other).sum() if keys else 0, len(keys)), "p (Wilcoxon)": chance},
                 source, note if told else f"fewer than {FEWEST} pairs: no test can tell")
