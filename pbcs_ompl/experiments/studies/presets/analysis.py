"""What a preset costs and what it solves."""

from pathlib import Path
from typing import Any

from pbcs_ompl.experiments.claims import Claim, greater, higher, rate, sometimes
from pbcs_ompl.figures.by_group import rates_figure, values_figure
from pbcs_ompl.figures.canvas import publish

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
    return higher('within the same budget "fast" solves more mazes than "thesis"', one, other, (FAST, THESIS), OURS)


def _literal(pairs: list[tuple[dict[str, Any], dict[str, Any]]]) -> Claim:
    runs = [thesis for _, thesis in pairs]
    small = [run for run in runs if run["size"] == 2]
    solved = rate(sum(run["solved"] for run in small), len(small))
    return (sometimes('the settings of the thesis solve some 2x2 mazes within the budget', "2x2", solved,
                      "[Matheron2020] 7.4, which gives no budget")
            .with_numbers(**{"3x3": rate(sum(run["solved"] for run in runs) - solved["successes"],
                                         len(runs) - len(small)),
                             "covered, where the budget ended": [run["reason"] for run in runs
                                                                 if not run["complete"]]}))


def _cheaper(pairs: list[tuple[dict[str, Any], dict[str, Any]]], key: str) -> Claim:
    fast, thesis = ({index: float(pair[side][key]) for index, pair in enumerate(pairs)} for side in (0, 1))
    words = {"transitions": "transitions", "cpu_seconds": "seconds of a core"}[key]
    return greater(f'"thesis" uses more {words} than "fast", solved or not', thesis, fast, (THESIS, FAST), OURS)


def _draw(records: Records, figures: Path) -> None:
    presets = list(dict.fromkeys(record["preset"] for record in records))
    sizes = sorted({record["size"] for record in records})
    groups = {preset: {f"{size}x{size}": [r for r in records if (r["preset"], r["size"]) == (preset, size)]
                       for size in sizes} for preset in presets}
    budget = max(record["max_transitions"] for record in records)
    publish(rates_figure({preset: {size: (sum(r["solved"] for r in runs), len(runs)) for size, runs in columns.items()}
                       for preset, columns in groups.items()}, title=f"Solved within {budget:,} transitions"),
         figures / "solved.png")
    for key, label in (("transitions", "transitions, solved or not"), ("cpu_seconds", "seconds of a core")):
        publish(values_figure({preset: {size: [r[key] for r in runs] for size, runs in columns.items()}
                            for preset, columns in groups.items()}, ylabel=label, log=True,
                           title="What a training costs"), figures / f"{key.replace('_', '-')}.png")
