"""Success under random actions, task by task, and what it cost."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.experiments.claims import FEWEST_PAIRS, Claim, rate
from pbcs_ompl.experiments.task_names import in_words
from pbcs_ompl.figures.canvas import colour, legend_below, new_panels, publish

Records = list[dict[str, Any]]
COLUMNS = 3
ENOUGH = 0.9
"""A method suffices for a plan of which at least this fraction of the executions with 10 % random actions succeeds."""
MOST = 0.5
NOISE = "0.1"
SOURCE = "ours"
COSTS = {"train_transitions": ",.0f", "cpu_seconds": ".1f", "ms_per_action": ".2g"}
"""What the table has of the costs, and how."""
APART = 0.25
"""By which the methods are drawn beside each other, in % of random actions."""


def analyse(records: Records, figures: Path) -> list[Claim]:
    """Draw a panel for each task and write the table; say where a regulator or predictive control suffices."""
    executed = [record for record in records if record.get("evaluations")]
    tasks = _distinct(executed, "task")
    if tasks:
        _draw(executed, tasks, figures)
        (figures / "table.md").write_text(_table(executed, tasks))
    return [_planned(records), _open_loop(executed, tasks), *(_suffices(method, executed, tasks) for method in (
        "lqr", "mppi", "follow", "pbcs", "reverse-curriculum"))]


def successes(records: Records, noise: str) -> tuple[int, int]:
    """Return the successful executions and all; a training without a policy has failed in all of them."""
    reached, total = 0, 0
    for record in records:
        found = record["evaluations"][noise]
        total += record["episodes"]
        reached += 0 if found is None else round(found["success_rate"] * found["episodes"])
    return reached, total


def plans(records: Records) -> tuple[int, int]:
    """Return for how many plans a method suffices, and of how many."""
    return sum(successes([record], NOISE)[0] >= ENOUGH * record["episodes"] for record in records), len(records)


def _distinct(records: Records, key: str) -> list[str]:
    return list(dict.fromkeys(record[key] for record in records))


def _of(records: Records, task: str, method: str) -> Records:
    return [record for record in records if record["task"] == task and record["method"] == method]


def _label(method: str, records: Records) -> str:
    privileged = any(record["privileged"] for record in records if record["method"] == method)
    return f"{method} (privileged)" if privileged else method


def _draw(records: Records, tasks: list[str], figures: Path) -> None:
    figure, panels = new_panels(-(-len(tasks) // COLUMNS), COLUMNS, 13.0, 3.3 * -(-len(tasks) // COLUMNS))
    methods = _distinct(records, "method")
    for axes, task in zip(panels, tasks, strict=False):
        for index, method in enumerate(methods):
            chosen = _of(records, task, method)
            if chosen:
                _draw_method(axes, chosen, (index - (len(methods) - 1) / 2) * APART, colour(index),
                             _in_legend(method, records))
        axes.set(title=in_words(task), xlabel="% random actions", ylim=(-0.04, 1.04))
        axes.grid(alpha=0.3)
    for axes in panels[len(tasks):]:
        axes.remove()
    figure.supylabel("share of successful executions (95 % Wilson; those of one seed share a plan)")
    legend_below(figure)
    publish(figure, figures / "closed-loop.png")


def _draw_method(axes: Axes, records: Records, shift: float, color: str, label: str) -> None:
    """Draw the successes of a method in one task, `shift` beside the fractions of random actions."""
    levels = list(records[0]["evaluations"])
    counts = [successes(records, level) for level in levels]
    rates = np.array([reached / total for reached, total in counts])
    bounds = np.array([wilson(*count) for count in counts]).T
    axes.errorbar([100 * float(level) + shift for level in levels], rates, np.abs(bounds - rates), fmt="o-", capsize=2,
                  linewidth=1.2, markersize=4, color=color, label=label)


def _in_legend(method: str, records: Records) -> str:
    """Return the label of a method with its numbers of plans, and of executions of each."""
    mine = [record for record in records if record["method"] == method]
    plans = sorted(len(_of(mine, task, method)) for task in _distinct(mine, "task"))
    count = f"{plans[0]}" if plans[0] == plans[-1] else f"{plans[0]} to {plans[-1]}"
    return f"{_label(method, records)}: {count} seeds, {mine[0]['episodes']} executions each"


def _table(records: Records, tasks: list[str]) -> str:
    """Return the table; "plans" are those for which the method suffices, of all."""
    levels = list(records[0]["evaluations"])
    lines = ["| task | method | plans | " + " | ".join(f"{100 * float(level):g} %" for level in levels)
             + " | transitions | CPU s | ms an action |",
             "|---|---|---|" + "---|" * len(levels) + "---|---|---|"]
    for task in tasks:
        for method in _distinct(records, "method"):
            chosen = _of(records, task, method)
            if chosen:
                rates = " | ".join("{} of {}".format(*successes(chosen, level)) for level in levels)
                enough = "{} of {}".format(*plans(chosen))
                costs = " | ".join(_median(chosen, key, form) for key, form in COSTS.items())
                lines.append(f"| {task} | {_label(method, records)} | {enough} | {rates} | {costs} |")
    return "\n".join(lines) + "\n"


def _median(records: Records, key: str, form: str) -> str:
    values = [record[key] for record in records if record[key] is not None]
    return format(float(np.median(values)), form) if values else ""


def _planned(records: Records) -> Claim:
    solved = {task: rate(sum(record["planned"] for record in mine), len(mine)) for task in _distinct(records, "task")
              for mine in [[record for record in records if record["task"] == task]]}
    return Claim("a plan is found for every seed of every task",
                 all(one["rate"] == 1.0 for one in solved.values()) if solved else None, solved, SOURCE)


def _rates(method: str, records: Records, tasks: list[str]) -> dict[str, dict[str, Any]]:
    found = {task: successes(_of(records, task, method), NOISE) for task in tasks}
    return {task: rate(*counts) for task, counts in found.items() if counts[1]}


def _open_loop(records: Records, tasks: list[str]) -> Claim:
    found = _rates("open-loop", records, tasks)
    fails = [task for task, one in found.items() if one["rate"] < ENOUGH]
    return Claim("with 10 % random actions a plan without feedback fails in most of the tasks (less than 90 %)",
                 len(fails) > len(found) / 2 if len(found) >= FEWEST_PAIRS else None, found or rate(0, 0), SOURCE)


def _suffices(method: str, records: Records, tasks: list[str]) -> Claim:
    """Claim that a method suffices for most plans of each task: plans are counted; executions of one are alike."""
    found = {task: rate(*plans(chosen)) for task in tasks for chosen in [_of(records, task, method)] if chosen}
    above = [task for task, one in found.items() if one["wilson"][0] > MOST]
    below = [task for task, one in found.items() if one["wilson"][1] < MOST]
    between = [task for task in found if task not in above + below]
    parts = (("above", above), ("below", below), ("not enough runs in", between))
    return Claim(f"{_label(method, records)} suffices for most plans of each task, with 10 % random actions (intervals "
                 "above one half)", False if below else True if found and not between else None, found or rate(0, 0),
                 SOURCE, "; ".join(f"{name}: {', '.join(map(in_words, some))}" for name, some in parts if some))
