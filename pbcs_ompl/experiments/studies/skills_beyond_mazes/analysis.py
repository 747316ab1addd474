"""Solve rates beyond the mazes, and of learnt activation sets against balls."""

from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Claim, at_least, no_higher, rate
from pbcs_ompl.experiments.task_names import in_words
from pbcs_ompl.figures.canvas import new_figure, publish

OURS = "beyond [Matheron2020], which trains in 2-D mazes only"
LEARNT = "-learnt"
MEDIANS = ("path_length", "plan_transitions", "train_transitions", "updates", "skills", "steps_median", "cpu_seconds")


def analyse(records: list[dict[str, Any]], figures: Path) -> list[Claim]:
    """Draw the solve rates; say which tasks are solved by most seeds, and whether learnt sets do as well as balls."""
    tasks = {task: [record for record in records if record["task"] == task]
             for task in dict.fromkeys(record["task"] for record in records)}
    solved = {task: rate(sum(record["solved"] for record in chosen), len(chosen)) for task, chosen in tasks.items()}
    if records:
        _draw(solved, tasks, figures / "solved.png")
    alone = [_most_seeds(task, solved[task], chosen) for task, chosen in tasks.items() if not task.endswith(LEARNT)]
    pairs = [_learnt(task, solved, tasks) for task in tasks if task + LEARNT in tasks]
    return [*alone, *pairs]


def _most_seeds(task: str, solved: dict[str, Any], records: list[dict[str, Any]]) -> Claim:
    return (at_least(f"PBCS solves {task} in most seeds", "solved", solved, 0.5, OURS)
            .with_numbers(**_medians(records)).with_note(_failures(records)))


def _learnt(task: str, solved: dict[str, Any], tasks: dict[str, list[dict[str, Any]]]) -> Claim:
    ball, learnt = solved[task], solved[task + LEARNT]
    numbers: dict[str, Any] = {}
    for name, one in (("ball", task), ("learnt", task + LEARNT)):
        numbers |= {f"{name}, {key}": value for key, value in _medians(tasks[one]).items()}
    return (no_higher(f"on {task} balls solve no more than learnt activation sets", ball, learnt, ("ball", "learnt"),
                      "[Matheron2020] 7.2.4 proposes them")
            .with_numbers(**numbers).with_note(_failures(tasks[task + LEARNT])))


def _medians(records: list[dict[str, Any]]) -> dict[str, Any]:
    """Return medians over all seeds, solved or not, and the success rates under random actions."""
    known = {key: [record[key] for record in records if record[key] is not None] for key in MEDIANS}
    medians = {f"{key}, median": round(float(np.median(values)), 1) for key, values in known.items() if values}
    return medians | {"succeed with a tenth of random actions": [record["success_rate"] for record in records]}


def _failures(records: list[dict[str, Any]]) -> str:
    failed = [f"seed {record['seed']}: {record['reason']}"
              for record in records if not record["solved"]]
    return "; ".join(failed)


def _in_words(task: str) -> str:
    return in_words(task.removesuffix(LEARNT)) + (", learnt sets" if task.endswith(LEARNT) else "")


def _draw(solved: dict[str, Any], tasks: dict[str, list[dict[str, Any]]], path: Path) -> None:
    figure, axes = new_figure(7.2, 0.5 * len(solved) + 1.4)
    places = np.arange(len(solved))
    rates = np.array([numbers["rate"] for numbers in solved.values()])
    low, high = np.array([numbers["wilson"] for numbers in solved.values()]).T
    axes.errorbar(rates, places, xerr=[np.maximum(rates - low, 0.0), np.maximum(high - rates, 0.0)], fmt="o", capsize=4)
    effort = {task: np.median([record["train_transitions"] for record in chosen]) for task, chosen in tasks.items()}
    axes.set_yticks(places, [f"{_in_words(task)} (N = {len(tasks[task])})\n{effort[task] / 1000:,.0f}k transitions"
                             for task in solved], fontsize=8)
    axes.set_ylim(len(solved) - 0.5, -0.5)
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel("share of solved seeds, 95 % Wilson interval")
    axes.grid(alpha=0.3)
    axes.set_title("PBCS beyond mazes; median transitions of training", fontsize=10)
    publish(figure, path)
