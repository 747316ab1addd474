"""Figures and claims of the half-cheetah study."""

from math import comb
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import mannwhitneyu, t

from pbcs_ompl.core.types import Array
from pbcs_ompl.experiments.claims import Claim, rate
from pbcs_ompl.figures.canvas import new_figure, save

LATE = 10
"""Episodes of the actor itself that say what has become of it; the thesis smooths over as many."""
LEVEL, TOO_FEW = 0.05, "too few seeds to decide"
P_VALUE = "p uncorrected (rank test)"
GOOD, SOLVED = 0.975, 0.95
"""Shares of the best return: the thesis asks the first of the good policy; we call a mean above the second solved."""


class Variant:
    """All seeds of one variant."""

    def __init__(self, records: list[dict[str, Any]]):
        self.best, self.seeds = records[0]["best"], len(records)
        primed = np.array(records[0]["primed"], dtype=np.bool_)
        every = np.array([record["returns"] for record in records])
        self.episodes = np.flatnonzero(~primed) + 1
        self.returns, self.expert = every[:, ~primed], every[:, primed]
        self.late = self.returns[:, -LATE:].mean(axis=1)

    @property
    def numbers(self) -> dict[str, Any]:
        """The late returns of the seeds, their mean, and its 95 % interval by Student's t."""
        return {"n": self.seeds, "mean": round(float(self.late.mean()), 1),
                "interval": self.interval, "seeds": self.late.round(1).tolist()}

    @property
    def interval(self) -> list[float] | None:
        """None for a single seed."""
        if self.seeds < 2:
            return None
        reach = t.ppf(0.975, self.seeds - 1) * self.late.std(ddof=1) / np.sqrt(self.seeds)
        return [round(float(self.late.mean() - reach), 1), round(float(self.late.mean() + reach), 1)]


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the curves, and compare what the actors have come to."""
    names = list(dict.fromkeys(record["variant"] for record in records))
    variants = {name: Variant([record for record in records if record["variant"] == name]) for name in names}
    for ending, figure in (("", "6.10c"), ("-primed", "6.11")):
        chosen = {name: variants[name] for name in (f"ddpg{ending}", f"ddpg-argmax{ending}") if name in variants}
        if chosen:
            _draw(chosen, f"Sparse HalfCheetah{', primed' if ending else ''} (Fig. {figure})",
                  figures / f"returns{ending}.png")
    return [*_found(variants), *_compared(variants), *_primed(variants)]


def _found(variants: dict[str, Variant]) -> list[Claim]:
    found = {name: rate((chosen.returns > 0.0).any(axis=1).sum(), chosen.seeds) for name, chosen in variants.items()
             if not chosen.expert.size}
    return [Claim("without priming, DDPG and DDPG-argmax find rewards, in every seed",
                  all(numbers["rate"] == 1.0 for numbers in found.values()) if found else None, found,
                  "[Matheron2020] 6.7")]


def _compared(variants: dict[str, Variant]) -> list[Claim]:
    """The thesis's three comparisons, each of the mean return in the last episodes."""
    higher = (("DDPG-argmax outperforms DDPG", "ddpg-argmax", "ddpg", "Fig. 6.10(c)"),
              ("DDPG does better with priming than without", "ddpg-primed", "ddpg", "Fig. 6.11"),
              ("with priming, too, DDPG-argmax outperforms DDPG", "ddpg-argmax-primed", "ddpg-primed", "Fig. 6.11"))
    claims = [_above(words, variants[one], variants[other], one, other, source)
              for words, one, other, source in higher if {one, other} <= set(variants)]
    one, other = "ddpg-argmax-primed", "ddpg-argmax"
    if {one, other} <= set(variants):
        p = _rank_test(variants[one], variants[other])
        claims.append(Claim(f"priming does not change DDPG-argmax (rank test of its late returns: p >= {LEVEL})",
                            None if p is None else p >= LEVEL,
                            {one: variants[one].numbers, other: variants[other].numbers, P_VALUE: p},
                            "[Matheron2020] Fig. 6.11", "" if p is not None else TOO_FEW))
    return claims


def _above(words: str, one: Variant, other: Variant, name: str, against: str, source: str) -> Claim:
    p = _rank_test(one, other)
    return Claim(f"{words} (mean return of the last {LATE} episodes)", bool(one.late.mean() > other.late.mean()),
                 {name: one.numbers, against: other.numbers, P_VALUE: p}, f"[Matheron2020] {source}",
                 TOO_FEW if p is None else "" if p < LEVEL else "it may be chance")


def _rank_test(one: Variant, other: Variant) -> float | None:
    """Return p of the two-sided test of Mann and Whitney; None where so few seeds cannot fall below LEVEL."""
    if 2.0 / comb(one.seeds + other.seeds, one.seeds) >= LEVEL:
        return None
    return round(float(mannwhitneyu(one.late, other.late).pvalue), 4)


def _primed(variants: dict[str, Variant]) -> list[Claim]:
    claims = []
    expert = np.concatenate([np.empty(0), *(chosen.expert.ravel() for chosen in variants.values())])
    if expert.size:
        best = next(iter(variants.values())).best
        claims.append(Claim(f"the good policy is good: above {GOOD * best:.0f} in most episodes, noise included",
                            bool(np.median(expert) > GOOD * best),
                            {"median": float(np.median(expert)), "least": float(expert.min()),
                             "above": rate((expert > GOOD * best).sum(), expert.size)}, "[Matheron2020] 6.7"))
    if "ddpg-primed" in variants:
        chosen = variants["ddpg-primed"]
        solved = rate((chosen.late > SOLVED * chosen.best).sum(), chosen.seeds)
        claims.append(Claim("with priming DDPG does not solve it in most seeds (late return above "
                            f"{SOLVED * chosen.best:.0f})", solved["rate"] < 0.5, {"solved": solved},
                            "[Matheron2020] Fig. 6.11"))
    return claims


def _draw(variants: dict[str, Variant], title: str, path: Path) -> None:
    """Draw mean and one standard deviation, as the thesis does, of the returns smoothed over LATE episodes."""
    figure, axes = new_figure(7.2, 4.6)
    for name, chosen in variants.items():
        smooth = np.array([_moving_average(row) for row in chosen.returns])
        episodes, mean, spread = chosen.episodes[-smooth.shape[1]:], smooth.mean(axis=0), smooth.std(axis=0)
        (line,) = axes.plot(episodes, mean, linewidth=2, label=f"{name} (N = {chosen.seeds})")
        axes.fill_between(episodes, mean - spread, mean + spread, color=line.get_color(), alpha=0.15, linewidth=0)
        for row in smooth:
            axes.plot(episodes, row, color=line.get_color(), linewidth=0.6, alpha=0.6)
    axes.axhline(next(iter(variants.values())).best, color="gray", linewidth=0.8, linestyle="--")
    axes.set_xlabel("episodes of 1000 steps; those of the good policy are left out")
    axes.set_ylabel(f"return, mean of {LATE} episodes; band: one deviation")
    axes.set_title(title, fontsize=10)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=9)
    save(figure, path)


def _moving_average(values: Array) -> Array:
    width = min(LATE, len(values))
    return np.convolve(values, np.full(width, 1.0 / width), mode="valid")
