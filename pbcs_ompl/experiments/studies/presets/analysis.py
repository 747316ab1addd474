"""What a preset costs and what it solves."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, rate
from pbcs_ompl.figures.by_group import rates_figure, values_figure
from pbcs_ompl.figures.canvas import save

Records = list[dict[str, Any]]
FAST, THESIS = "fast", "thesis"
OURS = 'ours: what the preset "fast" is for'


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw rates, transitions and seconds; compare the presets seed by seed."""
    if records:
        _draw(records, figures)
    fast, thesis = ({(r["size"], r["seed"]): r for r in records if r["preset"] == preset} for preset in (FAST, THESIS))
    pairs = [(fast[key], thesis[key]) for key in sorted(fast.keys() & thesis.keys())]
    return [_solves_more(pairs), _literal(pairs), *(_cheaper(pairs, key) for key in ("transitions", "cpu_seconds"))]


def _solves_more(pairs: list[tuple[dict[str, Any], dict[str, Any]]]) -> Claim:
    one, other = (rate(sum(pair[side]["solved"] for pair in pairs), len(pairs)) for side in (0, 1))
    return Claim('within the same budget "fast" solves more mazes than "thesis" (the intervals lie apart)',
                 one["wilson"][0] > other["wilson"][1] if pairs else None, {FAST: one, THESIS: other}, OURS)


def _literal(pairs: list[tuple[dict[str, Any], dict[str, Any]]]) -> Claim:
    runs = [thesis for _, thesis in pairs]
    small = [run for run in runs if run["size"] == 2]
    return Claim('the settings of the thesis solve some 2x2 mazes within the budget',
                 any(run["solved"] for run in small) if small else None,
                 {"2x2": rate(sum(run["solved"] for run in small), len(small)),
                  "3x3": rate(sum(run["solved"] for run in runs) - sum(run["solved"] for run in small),
                              len(runs) - len(small)),
                  "covered, where the budget ended": [run["reason"] for run in runs if not run["complete"]]},
                 "[Matheron2020] 7.4, which gives no budget")


def _cheaper(pairs: list[tuple[dict[str, Any], dict[str, Any]]], key: str) -> Claim:
    cheaper = rate(sum(fast["solved"] and fast[key] < thesis[key] for fast, thesis in pairs), len(pairs))
    medians = {name: float(np.median([pair[side][key] for pair in pairs])) if pairs else None
               for side, name in enumerate((FAST, THESIS))}
    words = {"transitions": "transitions", "cpu_seconds": "seconds of a core"}[key]
    return Claim(f'"fast" solves each maze with fewer {words} than "thesis" uses, solved or not',
                 cheaper["rate"] == 1.0 if pairs else None, {"with fewer": cheaper, f"{words}, median": medians}, OURS)


def _draw(records: Records, figures: Path) -> None:
    presets = list(dict.fromkeys(record["preset"] for record in records))
    sizes = sorted({record["size"] for record in records})
    groups = {preset: {f"{size}x{size}": [r for r in records if (r["preset"], r["size"]) == (preset, size)]
                       for size in sizes} for preset in presets}
    budget = max(record["max_transitions"] for record in records)
    save(rates_figure({preset: {size: (sum(r["solved"] for r in runs), len(runs)) for size, runs in columns.items()}
                       for preset, columns in groups.items()}, title=f"Solved within {budget:,} transitions"),
         figures / "solved.png")
    for key, label in (("transitions", "transitions, solved or not"), ("cpu_seconds", "seconds of a core")):
        save(values_figure({preset: {size: [r[key] for r in runs] for size, runs in columns.items()}
                            for preset, columns in groups.items()}, ylabel=label, log=True,
                           title="What a training costs"), figures / f"{key.replace('_', '-')}.png")
