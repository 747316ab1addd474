"""What the bins and the batches cost Ex."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, always, greater, rate
from pbcs_ompl.experiments.task_names import in_words
from pbcs_ompl.figures.by_group import values_figure
from pbcs_ompl.figures.canvas import publish

Records = list[dict[str, Any]]
NAMES = {"bin_size": "edge of the bins", "batch": "nodes expanded together"}
OURS = "ours: the settings of Ex that [Matheron2020] 3.3 leaves open"


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw transitions and seconds for each value; compare the values seed by seed."""
    scenes = list(dict.fromkeys(record["scene"] for record in records))
    for option in NAMES:
        for key in ("transitions", "seconds"):
            _draw(records, scenes, option, key, figures)
    claims = [_all_solved(records)]
    for scene in scenes:
        chosen = [record for record in records if record["scene"] == scene]
        claims += [*_bins(chosen, in_words(scene)), *_batches(chosen, in_words(scene))]
    return claims


def _all_solved(records: Records) -> Claim:
    solved = rate(sum(record["solved"] for record in records), len(records))
    worst: dict[str, int] = {}
    for record in records:
        if not record["solved"]:
            name = f"{in_words(record['scene'])}, {record['option']} {record['value']:g}"
            worst[name] = worst.get(name, 0) + 1
    return always("Ex finds the goal within the budget with every value tried", "solved", solved,
                  OURS).with_numbers(failures=worst)


def _costs(records: Records, option: str, key: str = "transitions") -> dict[float, dict[int, float]]:
    """Return, for each value of an option, a number of each seed; an unsolved run has used the budget at least."""
    values = sorted({record["value"] for record in records if record["option"] == option})
    return {value: {r["seed"]: float(r[key]) for r in records if (r["option"], r["value"]) == (option, value)}
            for value in values}


def _medians(costs: dict[float, dict[int, float]]) -> dict[str, float]:
    return {f"{value:g}": float(np.median(list(column.values()))) for value, column in costs.items()}


def _bins(records: Records, scene: str) -> list[Claim]:
    costs = _costs(records, "bin_size")
    suggested, medians = records[0]["suggested"], _medians(costs)
    if suggested not in costs or len(costs) < 2:
        return []
    best = min(costs, key=lambda value: medians[f"{value:g}"])
    largest = max(costs)
    bar = {seed: 1.5 * cost for seed, cost in costs[best].items()}
    return [greater(f"{scene}: the suggested bins need less than 1.5 times the transitions of the best bins", bar,
                    costs[suggested], (f"1.5 times {best:g}", f"{suggested:g}"), OURS).with_numbers(
                        transitions_median=medians),
            greater(f"{scene}: bins of {largest:g} need more transitions than the suggested ones", costs[largest],
                    costs[suggested], (f"{largest:g}", f"{suggested:g}"), OURS)]


def _batches(records: Records, scene: str) -> list[Claim]:
    transitions, seconds = _costs(records, "batch"), _costs(records, "batch", "seconds")
    if 1 not in transitions or len(transitions) < 2:
        return []
    most = max(transitions)
    return [greater(f"{scene}: {most:g} nodes expanded together need more {name} than one at a time", costs[most],
                    costs[1], (f"{most:g}", "1"), OURS)
            for name, costs in (("transitions", transitions), ("seconds", seconds))]


def _draw(records: Records, scenes: list[str], option: str, key: str, figures: Path) -> None:
    columns = {scene: {value: list(numbers.values()) for value, numbers in
                       _costs([record for record in records if record["scene"] == scene], option, key).items()}
               for scene in scenes}
    named = {in_words(scene): {f"{value:g}": numbers for value, numbers in groups.items()}
             for scene, groups in columns.items()}
    publish(values_figure(named, xlabel=NAMES[option], ylabel=f"{key} to the goal", log=True,
                       title=f"Ex: {key} by {NAMES[option]}"), figures / f"{option.replace('_', '-')}-{key}.png")
