"""Figures and claims of the half-cheetah study."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy.stats import t

from pbcs_ompl.core.types import Array
from pbcs_ompl.experiments.claims import PAIRS, Claim, always, at_least, at_most, greater_apart, rate
from pbcs_ompl.figures.canvas import BAND, colour, legend_below, new_panels, publish

LATE = 10
"""Episodes of the actor itself that say what has become of it; the thesis smooths over as many."""
GOOD, SOLVED = 0.975, 0.95
"""Shares of the best return: the thesis asks the first of the good policy; we call a mean above the second solved."""

PANELS = {"": "alone (Fig. 6.10c)", "-primed": "with a good policy in one episode of twenty (Fig. 6.11)"}
NAMES = {"ddpg": "DDPG", "ddpg-argmax": "DDPG-argmax"}


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
    if variants:
        _draw(variants, figures)
    return [*_found(variants), *_compared(variants), *_primed(variants)]


def _found(variants: dict[str, Variant]) -> list[Claim]:
    found = {name: rate((chosen.returns > 0.0).any(axis=1).sum(), chosen.seeds) for name, chosen in variants.items()
             if not chosen.expert.size}
    every = rate(sum(one["successes"] for one in found.values()), sum(one["n"] for one in found.values()))
    return [always("without priming, DDPG and DDPG-argmax find rewards, in every seed", "find some", every,
                   "[Matheron2020] 6.7").with_numbers(**found)]


def _compared(variants: dict[str, Variant]) -> list[Claim]:
    """The thesis's three comparisons, each of the mean return in the last episodes."""
    higher = (("DDPG-argmax outperforms DDPG", "ddpg-argmax", "ddpg", "Fig. 6.10(c)"),
              ("DDPG does better with priming than without", "ddpg-primed", "ddpg", "Fig. 6.11"),
              ("with priming, too, DDPG-argmax outperforms DDPG", "ddpg-argmax-primed", "ddpg-primed", "Fig. 6.11"))
    claims = [_above(words, variants[one], variants[other], one, other, source)
              for words, one, other, source in higher if {one, other} <= set(variants)]
    one, other = "ddpg-argmax-primed", "ddpg-argmax"
    if {one, other} <= set(variants):
        ways = [greater_apart("priming does not change DDPG-argmax", variants[first].late.tolist(),
                              variants[second].late.tolist(), (first, second), "[Matheron2020] Fig. 6.11")
                for first, second in ((one, other), (other, one))]
        changed = any(way.agrees for way in ways)
        enough = min(variants[one].seeds, variants[other].seeds) >= PAIRS
        claims.append(replace(ways[0], agrees=False if changed else True if enough else None,
                              note="" if changed or enough else f"not enough seeds: {PAIRS} of each"))
    return claims


def _above(words: str, one: Variant, other: Variant, name: str, against: str, source: str) -> Claim:
    return greater_apart(f"{words}: mean return of the last {LATE} episodes", one.late.tolist(), other.late.tolist(),
                         (name, against), f"[Matheron2020] {source}").with_numbers(
                             **{name: one.numbers, against: other.numbers})


def _primed(variants: dict[str, Variant]) -> list[Claim]:
    claims = []
    expert = np.concatenate([np.empty(0), *(chosen.expert.ravel() for chosen in variants.values())])
    if expert.size:
        best = next(iter(variants.values())).best
        claims.append(at_least(f"the good policy is good: above {GOOD * best:.0f} in most episodes, noise included",
                               "above", rate((expert > GOOD * best).sum(), expert.size), 0.5, "[Matheron2020] 6.7")
                      .with_numbers(median=float(np.median(expert)), least=float(expert.min())))
    if "ddpg-primed" in variants:
        chosen = variants["ddpg-primed"]
        solved = rate((chosen.late > SOLVED * chosen.best).sum(), chosen.seeds)
        claims.append(at_most("with priming DDPG does not solve it in most seeds (late return above "
                              f"{SOLVED * chosen.best:.0f})", "solved", solved, 0.5, "[Matheron2020] Fig. 6.11"))
    return claims


def _draw(variants: dict[str, Variant], figures: Path) -> None:
    """Draw the returns, smoothed over LATE episodes: all seeds, the mean and its 95 % interval by Student's t."""
    figure, panels = new_panels(1, 2, 11.0, 4.6)
    for axes, (ending, title) in zip(panels, PANELS.items(), strict=True):
        for index, name in enumerate(("ddpg", "ddpg-argmax")):
            if f"{name}{ending}" in variants:
                _draw_returns(axes, variants[f"{name}{ending}"], NAMES[name], colour(index))
        axes.axhline(next(iter(variants.values())).best, color="gray", linewidth=0.8, linestyle="--")
        axes.set_xlabel("episodes of 1000 steps; those of the good policy are left out")
        axes.set_title(title, fontsize=10)
        axes.grid(alpha=0.3)
    panels[0].set_ylabel(f"return, mean of {LATE} episodes; band: 95 % (Student's t)")
    figure.suptitle("Sparse HalfCheetah", fontsize=10)
    legend_below(figure)
    publish(figure, figures / "returns.png")


def _draw_returns(axes: Axes, chosen: Variant, name: str, shade: str) -> None:
    smooth = np.array([_moving_average(row) for row in chosen.returns])
    episodes, mean = chosen.episodes[-smooth.shape[1]:], smooth.mean(axis=0)
    axes.plot(episodes, mean, linewidth=2, color=shade, label=f"{name} (N = {chosen.seeds})")
    axes.plot(episodes, smooth.T, color=shade, linewidth=0.6, alpha=0.6)
    if chosen.seeds > 1:
        reach = t.ppf(0.975, chosen.seeds - 1) * smooth.std(axis=0, ddof=1) / np.sqrt(chosen.seeds)
        axes.fill_between(episodes, mean - reach, mean + reach, color=shade, alpha=BAND, linewidth=0)


def _moving_average(values: Array) -> Array:
    width = min(LATE, len(values))
    return np.convolve(values, np.full(width, 1.0 / width), mode="valid")
