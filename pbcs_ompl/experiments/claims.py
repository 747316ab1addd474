"""What a study claims, and whether its data agree, differ, or are too few to decide.

A claim differs only where the test had the power to find what it denies: with fewer runs the verdict is None, and the
note says how many would decide. Rates are compared by Fisher's exact test, paired numbers by Wilcoxon's signed ranks,
others by Mann and Whitney's ranks; one rate is compared with a bar by its 95 % Wilson interval.
"""

from bisect import bisect_left
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from math import ceil
from typing import Any, TypeVar

import numpy as np
from scipy.stats import binom, hypergeom, mannwhitneyu, wilcoxon

from pbcs_ompl.core.statistics import wilson

Key = TypeVar("Key", bound=Hashable)
Rate = dict[str, Any]
"""What `rate` returns."""
SIGNIFICANCE, POWER = 0.05, 0.8
APART = (0.7, 0.3)
"""Two rates that must be separable before a study says that rates do not differ, where its source gives none."""
RARE = 0.1
"""What was never seen is said to be absent where the interval of its rate ends below this number."""
FEWEST_PAIRS = 5
"""With fewer pairs even the clearest difference has a p-value above 0.05."""
PAIRS = 10
"""This number detects a difference that nine of ten pairs have, with a power of 0.8 at least (by simulation)."""
MOST_RUNS = 400
QUANTILE = 1.959964
"""Of the normal distribution, for 95 % intervals."""


@dataclass(frozen=True)
class Claim:
    """A sentence that is true or false of the data.

    Attributes:
        claim: The sentence, with the condition that was checked.
        agrees: Whether the data agree; None when they are too few to decide.
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

    def with_numbers(self, **numbers: Any) -> "Claim":
        """Return the claim with more numbers; underscores of their names are spaces."""
        return replace(self, numbers=self.numbers | {name.replace("_", " "): value for name, value in numbers.items()})

    def with_note(self, note: str) -> "Claim":
        """Return the claim with an explanation before what its note says."""
        return replace(self, note="; ".join(part for part in (note, self.note) if part))


def rate(successes: int, trials: int) -> Rate:
    """Return {"successes", "n", "rate", "wilson"}: a rate, None without trials, and its 95 % Wilson interval."""
    successes, trials = int(successes), int(trials)
    return {"successes": successes, "n": trials, "rate": successes / trials if trials else None,
            "wilson": list(wilson(successes, trials))}


def always(claim: str, name: str, found: Rate, source: str) -> Claim:
    """Claim that a rate is 1: one failure denies it.

    Args:
        claim: The sentence.
        name: What to call the rate.
        found: The rate.
        source: Where the claim comes from.
    """
    failed = found["successes"] < found["n"]
    enough = found["wilson"][0] > 1.0 - RARE
    return Claim(claim, False if failed else True if enough else None, {name: found}, source,
                 "" if failed or enough else _too_few(found["n"], _runs_to_be_sure(1.0 - RARE)))


def sometimes(claim: str, name: str, found: Rate, source: str) -> Claim:
    """Claim that a rate is not 0: one success shows it; see `always` for the arguments."""
    enough = found["wilson"][1] < RARE
    return Claim(claim, True if found["successes"] else False if enough else None, {name: found}, source,
                 "" if found["successes"] or enough else _too_few(found["n"], _runs_to_be_sure(1.0 - RARE)))


def never(claim: str, name: str, found: Rate, source: str) -> Claim:
    """Claim that a rate is 0: one success denies it; see `always` for the arguments."""
    seen = sometimes(claim, name, found, source)
    return replace(seen, agrees=None if seen.agrees is None else not seen.agrees)


def at_least(claim: str, name: str, found: Rate, bar: float, source: str) -> Claim:
    """Claim that a rate is at least `bar` (its interval lies above, or below); see `always` for the arguments."""
    low, high = found["wilson"]
    verdict = True if low >= bar else False if high < bar else None
    return Claim(f"{claim} (its interval lies above {bar:.3g})", verdict, {name: found}, source,
                 "" if verdict is not None else _too_few(found["n"], _runs_to_be_sure(bar), "even if all succeed"))


def at_most(claim: str, name: str, found: Rate, bar: float, source: str) -> Claim:
    """Claim that a rate is at most `bar` (its interval lies below, or above); see `always` for the arguments."""
    low, high = found["wilson"]
    verdict = True if high <= bar else False if low > bar else None
    return Claim(f"{claim} (its interval lies below {bar:.3g})", verdict, {name: found}, source,
                 "" if verdict is not None else _too_few(found["n"], _runs_to_be_sure(1.0 - bar), "even if none does"))


def about(claim: str, name: str, found: Rate, expected: float, tolerance: float, source: str) -> Claim:
    """Claim that a rate is `expected`: its interval lies within +-tolerance of it, or does not hold it.

    Args:
        claim, name, found, source: See `always`.
        expected: The rate that is claimed.
        tolerance: What is near it.
    """
    low, high = found["wilson"]
    near = expected - tolerance <= low and high <= expected + tolerance
    verdict = True if near else False if not low <= expected <= high else None
    needed = ceil(QUANTILE**2 * expected * (1.0 - expected) / tolerance**2)
    return Claim(f"{claim} (its interval lies within {tolerance:.3g} of {expected:.3g})", verdict, {name: found},
                 source, "" if verdict is not None else _too_few(found["n"], needed))


def higher(claim: str, first: Rate, second: Rate, names: tuple[str, str], source: str,
           expected: tuple[float, float] = APART) -> Claim:
    """Claim that the first rate is higher, by Fisher's exact test, one-sided.

    Not so where the test shows the opposite, or would have shown the expected rates in four cases of five.

    Args:
        claim: The sentence.
        first, second: The rates.
        names: What to call the two.
        source: Where the claim comes from.
        expected: The two rates that the source gives, the higher one first.
    """
    up, down = (_fisher(*pair) for pair in ((first, second), (second, first)))
    able = min(first["n"], second["n"]) > 0 and _power((first["n"], second["n"]), expected) >= POWER
    verdict = True if up < SIGNIFICANCE else False if down < SIGNIFICANCE or able else None
    return Claim(f"{claim} (p < {SIGNIFICANCE})", verdict,
                 {names[0]: first, names[1]: second, "p uncorrected (Fisher)": round(up, 5)}, source,
                 "" if verdict is not None else f"not enough runs: {fewest_runs(*expected)} of each separate rates of "
                                                f"{expected[0]:g} and {expected[1]:g}")


def no_higher(claim: str, first: Rate, second: Rate, names: tuple[str, str], source: str) -> Claim:
    """Claim that the first rate is not higher; see `higher` for the arguments."""
    opposite = higher(claim, first, second, names, source)
    return replace(opposite, claim=f"{claim} (not with p < {SIGNIFICANCE})",
                   agrees=None if opposite.agrees is None else not opposite.agrees)


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

    def chance(alternative: str) -> float:
        if len(keys) < FEWEST_PAIRS or (one == other).all():
            return 1.0
        test: Any = wilcoxon(one, other, alternative=alternative)
        return float(test.pvalue)

    numbers = _medians(names, one, other) | {"greater": rate((one > other).sum() if keys else 0, len(keys))}
    return _by_ranks(claim, chance("greater"), chance("less"), len(keys), "pairs",
                     numbers | {"p uncorrected (Wilcoxon)": chance("greater")}, source, note)


def greater_apart(claim: str, first: Sequence[float], second: Sequence[float], names: tuple[str, str], source: str,
                  note: str = "") -> Claim:
    """Claim that the first numbers are greater, by the one-sided test of Mann and Whitney: runs that are no pairs.

    Args:
        claim, names, source, note: See `greater`.
        first, second: A number for each run.
    """
    one, other = np.array(first, dtype=np.float64), np.array(second, dtype=np.float64)
    few = min(len(one), len(other))
    up, down = (float(mannwhitneyu(one, other, alternative=side).pvalue) if few else 1.0
                for side in ("greater", "less"))
    return _by_ranks(claim, up, down, few, "runs of each", {**_medians(names, one, other), "N": [len(one), len(other)],
                                                            "p uncorrected (Mann-Whitney)": up}, source, note)


def _by_ranks(claim: str, up: float, down: float, count: int, what: str, numbers: dict[str, Any], source: str,
              note: str) -> Claim:
    verdict = True if up < SIGNIFICANCE else False if down < SIGNIFICANCE or count >= PAIRS else None
    too_few = "" if verdict is not None else f"not enough runs: {count} {what}; {PAIRS} detect a clear difference"
    return Claim(f"{claim} (p < {SIGNIFICANCE})", verdict, numbers, source).with_note(too_few).with_note(note)


def _medians(names: tuple[str, str], *columns: np.ndarray) -> dict[str, Any]:
    return {f"median, {name}": float(np.median(values)) if len(values) else None
            for name, values in zip(names, columns, strict=True)}


def _fisher(first: Rate, second: Rate) -> float:
    """Return p of the one-sided test that the first rate is higher."""
    wins, trials = first["successes"] + second["successes"], first["n"] + second["n"]
    return float(hypergeom.sf(first["successes"] - 1, trials, wins, first["n"])) if trials else 1.0


@cache
def fewest_runs(high: float, low: float) -> int:
    """Return how many runs of each kind separate two rates by Fisher's test with a power of 0.8, or `MOST_RUNS`."""
    return bisect_left(range(MOST_RUNS), True, key=lambda runs: _power((runs, runs), (high, low)) >= POWER)


@cache
def _power(sizes: tuple[int, int], rates: tuple[float, float]) -> float:
    """Return how likely Fisher's test with `sizes` runs shows that the first of two true rates is the higher one."""
    one, other = (np.arange(size + 1) for size in sizes)
    together = one[:, None] + other[None]
    significant = hypergeom.sf(one[:, None] - 1, sum(sizes), together, sizes[0]) < SIGNIFICANCE
    chances = (binom.pmf(counts, size, chance) for counts, size, chance in zip((one, other), sizes, rates, strict=True))
    return float(np.einsum("ij,i,j->", significant, *chances))


def _runs_to_be_sure(bar: float) -> int:
    """Return how many successes in a row have an interval above `bar`."""
    return ceil(QUANTILE**2 * bar / (1.0 - bar) - 1e-9)


def _too_few(have: int, needed: int, how: str = "") -> str:
    return f"not enough runs: {have}, expected at least {max(needed, have + 1)}{', ' * bool(how)}{how}"
