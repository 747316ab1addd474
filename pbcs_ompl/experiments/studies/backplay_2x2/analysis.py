"""What Backplay, the discount and the reward do in the 2x2 maze, as figures and claims."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm

from pbcs_ompl.experiments.claims import Claim, Rate, at_least, at_most, greater, higher, no_higher, rate
from pbcs_ompl.figures.by_group import rates_figure
from pbcs_ompl.figures.canvas import QUANTITIES, publish
from pbcs_ompl.figures.maze import legend_below, map_axes
from pbcs_ompl.resettable import make

Records = list[dict[str, Any]]
LOW, HIGH = 0.9, 0.99


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw the rates and the visits of DDPG alone; compare."""
    trainings = [record for record in records if "method" in record]
    corrections = {record["discount"]: record for record in records if record["label"] == "correction"}
    alone = [record for record in records if record["label"] == "alone"]
    claims = []
    if trainings:
        _draw_rates(trainings, figures)
        claims += [*_backplay(trainings), *_discount(trainings), *_shaping(trainings), *_variants(trainings)]
    for record in alone[-1:]:
        _draw_visits(record, figures)
        claims.append(_never_found(record))
    if {LOW, HIGH} <= set(corrections):
        claims.append(_slow_to_correct(*(corrections[discount] for discount in (HIGH, LOW))))
    return claims


def _success_rate(records: Records, label: str, *, reward: str = "sparse",
                  discount: float | None = None) -> dict[str, Any]:
    chosen = [record for record in records if (record["label"], record["reward"]) == (label, reward)
              and discount in (None, record["discount"])]
    return rate(sum(record["succeeds"] for record in chosen), len(chosen))


def _more(claim: str, one: tuple[str, Rate], other: tuple[str, Rate], source: str) -> Claim:
    """Claim that the first rate is the higher one."""
    return higher(claim, one[1], other[1], (one[0], other[0]), f"[Matheron2020] {source}")


def _backplay(records: Records) -> list[Claim]:
    backplay, alone = _success_rate(records, "PB"), _success_rate(records, "DDPG")
    return [_more("PB succeeds more often than DDPG alone, from the sparse reward", ("PB", backplay), ("DDPG", alone),
                  "5.6, Fig. 5.3"),
            at_least("even in the 2x2 maze PB regularly fails, in at least one run of ten", "fails",
                     rate(backplay["n"] - backplay["successes"], backplay["n"]), 0.1, "[Matheron2020] 5.6")]


def _discount(records: Records) -> list[Claim]:
    rates = {(label, discount): _success_rate(records, label, discount=discount)
             for label in ("PB", "DDPG") for discount in (LOW, HIGH)}
    alone = rates["DDPG", LOW], rates["DDPG", HIGH]
    return [_more(f"PB succeeds more often with the discount {LOW} than with {HIGH}", (f"{LOW}", rates["PB", LOW]),
                  (f"{HIGH}", rates["PB", HIGH]), "5.5, Fig. 5.2"),
            no_higher(f"DDPG alone succeeds no more often with {LOW} than with {HIGH}", *alone, (f"{LOW}", f"{HIGH}"),
                      "[Matheron2020] 5.5, Fig. 5.2")]


def _shaping(records: Records) -> list[Claim]:
    def rates(label: str) -> list[tuple[str, dict[str, Any]]]:
        return [(reward, _success_rate(records, label, reward=reward)) for reward in ("sparse", "shaped")]

    (sparse, shaped), (sparse_pb, shaped_pb) = rates("DDPG"), rates("PB")
    return [_more("the shaped reward makes DDPG alone succeed less often", sparse, shaped, "7.2.3"),
            _more("the shaped reward makes PB succeed more often", shaped_pb, sparse_pb, "7.2.3, Fig. 7.1")]


def _variants(records: Records) -> list[Claim]:
    """Compare PB's starts, its pretest and the sliding window, from the sparse reward with the low discount."""
    pb, balls, untested, window = (_success_rate(records, label, discount=LOW) for label in (
        "PB", "PB, starts in balls", "PB without pretest", "sliding window"))
    chosen = [{record["seed"]: record for record in records
               if (record["label"], record["reward"], record["discount"]) == (label, "sparse", LOW)}
              for label in ("PB", "PB without pretest")]
    # Where both used up the budget, which of them is slower is not known.
    known = {seed for one in chosen for seed, record in one.items() if record["succeeds"]}
    spent, without = ({seed: float(record["transitions"]) for seed, record in one.items() if seed in known}
                      for one in chosen)
    return [_more("starts in balls make PB succeed more often than exact ones", ("balls", balls), ("exact", pb),
                  "7.2.4"),
            _more("PB succeeds more often than the sliding window of Backplay", ("PB", pb), ("window", window), "5.2"),
            greater("PB takes more transitions without the pretest", without, spent, ("without", "with"),
                    "[Matheron2020] 5.3, Fig. 5.1(b)").with_numbers(succeed_without=untested)]


def _never_found(record: dict[str, Any]) -> Claim:
    first = np.array(record["first_reward"])
    found = rate((first > 0).sum(), len(first))
    return at_most(f"DDPG alone meets no reward within {record['steps']:,} steps in most runs", "meet it", found, 0.5,
                   "[Matheron2020] 5.6, Fig. 5.4").with_numbers(
                       first_steps_with_reward=sorted(first[first > 0].tolist()))


def _slow_to_correct(high: dict[str, Any], low: dict[str, Any]) -> Claim:
    """Compare how many updates halve a value that is too high; those that were too few count as infinitely many."""
    first, second = ({seed: float(updates) if updates > 0 else np.inf for seed, updates in
                      zip(record["seeds"], record["halved"], strict=True)} for record in (high, low))
    return greater(f"updates that halve the value of pushing against a wall: more with the discount {HIGH} than with "
                   f"{LOW}", first, second, (f"{HIGH}", f"{LOW}"), "[Matheron2020] 5.5")


def _draw_rates(records: Records, figures: Path) -> None:
    counts: dict[str, dict[str, tuple[int, int]]] = {}
    for label in dict.fromkeys(record["label"] for record in records):
        counts[label] = {}
        for discount, reward in dict.fromkeys((record["discount"], record["reward"]) for record in records):
            found = _success_rate(records, label, reward=reward, discount=discount)
            counts[label][f"discount {discount}\n{reward} reward"] = found["successes"], found["n"]
    title = f"2x2 maze, at most {records[0]['max_transitions']:,} transitions (Figs. 5.2, 5.3, 7.1)"
    publish(rates_figure(counts, title=title, ylabel="share of runs that succeed"), figures / "rates.png")


def _draw_visits(record: dict[str, Any], figures: Path) -> None:
    model = make("pbcs/Maze-v0", {"size": 2})
    visits = np.array(record["visits"], dtype=float)
    first = record["first_reward"][0]
    met = "the reward was never met" if first < 0 else f"the reward was met first in step {first:,}"
    title = f"DDPG alone, seed {record['seeds'][0]}, {record['steps']:,} steps: {met} (Fig. 5.4)"
    figure, axes = map_axes(model, title)
    edges = [np.linspace(low, high, len(visits) + 1)
             for low, high in zip(model.state_low, model.state_high, strict=True)]
    mesh = axes.pcolormesh(*edges, np.where(visits > 0, visits, np.nan).T, norm=LogNorm(), cmap=QUANTITIES, zorder=1)
    figure.colorbar(mesh, ax=axes, label="visits", shrink=0.8)
    legend_below(axes)
    publish(figure, figures / "visits.png")
