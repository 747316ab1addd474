"""What Backplay, the discount and the reward do in the 2x2 maze, as figures and claims."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm

from pbcs_ompl.experiments.claims import Claim, rate
from pbcs_ompl.figures.by_group import rates_figure
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.maze import legend_below, map_axes
from pbcs_ompl.resettable import make

Records = list[dict[str, Any]]
LOW, HIGH = 0.9, 0.99


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw the rates and the visits of DDPG alone; compare."""
    trainings = [record for record in records if record["label"] != "alone"]
    alone = [record for record in records if record["label"] == "alone"]
    claims = []
    if trainings:
        _draw_rates(trainings, figures)
        claims += [*_backplay(trainings), *_discount(trainings), *_shaping(trainings)]
    for record in alone[-1:]:
        _draw_visits(record, figures)
        claims.append(_never_found(record))
    return claims


def _success_rate(records: Records, label: str, *, reward: str = "sparse",
                  discount: float | None = None) -> dict[str, Any]:
    chosen = [record for record in records if (record["label"], record["reward"]) == (label, reward)
              and discount in (None, record["discount"])]
    return rate(sum(record["succeeds"] for record in chosen), len(chosen))


def _more(claim: str, one: tuple[str, dict[str, Any]], other: tuple[str, dict[str, Any]], source: str) -> Claim:
    """Claim that the first rate is the higher one."""
    decided = one[1]["n"] and other[1]["n"]
    apart = one[1]["wilson"][0] > other[1]["wilson"][1] or other[1]["wilson"][0] > one[1]["wilson"][1]
    return Claim(claim, one[1]["rate"] > other[1]["rate"] if decided else None,
                 {**dict((one, other)), "the intervals lie apart": apart}, f"[Matheron2020] {source}",
                 "" if apart else "the intervals overlap: so few runs cannot separate these rates")


def _backplay(records: Records) -> list[Claim]:
    backplay, alone = _success_rate(records, "PB"), _success_rate(records, "DDPG")
    return [_more("PB succeeds more often than DDPG alone, from the sparse reward", ("PB", backplay), ("DDPG", alone),
                  "5.6, Fig. 5.3"),
            Claim("even in the 2x2 maze PB regularly fails (in at least one run of ten)",
                  backplay["rate"] <= 0.9 if backplay["n"] else None, {"succeeds": backplay}, "[Matheron2020] 5.6")]


def _discount(records: Records) -> list[Claim]:
    rates = {(label, discount): _success_rate(records, label, discount=discount)
             for label in ("PB", "DDPG") for discount in (LOW, HIGH)}
    alone = rates["DDPG", LOW], rates["DDPG", HIGH]
    return [_more(f"PB succeeds more often with the discount {LOW} than with {HIGH}", (f"{LOW}", rates["PB", LOW]),
                  (f"{HIGH}", rates["PB", HIGH]), "5.5, Fig. 5.2"),
            Claim(f"DDPG alone succeeds no more often with {LOW} than with {HIGH}",
                  alone[0]["rate"] <= alone[1]["rate"] if alone[0]["n"] and alone[1]["n"] else None,
                  {f"{LOW}": alone[0], f"{HIGH}": alone[1]}, "[Matheron2020] 5.5, Fig. 5.2")]


def _shaping(records: Records) -> list[Claim]:
    def rates(label: str) -> list[tuple[str, dict[str, Any]]]:
        return [(reward, _success_rate(records, label, reward=reward)) for reward in ("sparse", "shaped")]

    (sparse, shaped), (sparse_pb, shaped_pb) = rates("DDPG"), rates("PB")
    return [_more("the shaped reward makes DDPG alone succeed less often", sparse, shaped, "7.2.3"),
            _more("the shaped reward makes PB succeed more often", shaped_pb, sparse_pb, "7.2.3, Fig. 7.1")]


def _never_found(record: dict[str, Any]) -> Claim:
    first = np.array(record["first_reward"])
    found = rate((first > 0).sum(), len(first))
    return Claim(f"DDPG alone meets no reward within {record['steps']:,} steps in most runs", found["rate"] < 0.5,
                 {"meet it": found, "first steps with reward": sorted(first[first > 0].tolist())},
                 "[Matheron2020] 5.6, Fig. 5.4")


def _draw_rates(records: Records, figures: Path) -> None:
    counts: dict[str, dict[str, tuple[int, int]]] = {}
    for label in dict.fromkeys(record["label"] for record in records):
        counts[label] = {}
        for discount, reward in dict.fromkeys((record["discount"], record["reward"]) for record in records):
            found = _success_rate(records, label, reward=reward, discount=discount)
            counts[label][f"discount {discount}\n{reward} reward"] = found["successes"], found["n"]
    title = f"2x2 maze, at most {records[0]['max_transitions']:,} transitions (Figs. 5.2, 5.3, 7.1)"
    save(rates_figure(counts, title=title, ylabel="share of runs that succeed"), figures / "rates.png")


def _draw_visits(record: dict[str, Any], figures: Path) -> None:
    model = make("pbcs/Maze-v0", {"size": 2})
    visits = np.array(record["visits"], dtype=float)
    first = record["first_reward"][0]
    met = "the reward was never met" if first < 0 else f"the reward was met first in step {first:,}"
    title = f"DDPG alone, seed {record['seeds'][0]}, {record['steps']:,} steps: {met} (Fig. 5.4)"
    figure, axes = map_axes(model, title)
    edges = [np.linspace(low, high, len(visits) + 1)
             for low, high in zip(model.state_low, model.state_high, strict=True)]
    mesh = axes.pcolormesh(*edges, np.where(visits > 0, visits, np.nan).T, norm=LogNorm(), cmap="Blues", zorder=1)
    figure.colorbar(mesh, ax=axes, label="visits", shrink=0.8)
    legend_below(axes)
    save(figure, figures / "visits.png")
