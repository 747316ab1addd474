"""Planners compared: how many transitions they need, and how much they have seen after how many."""

from collections.abc import Callable, Mapping, Sequence
from math import ceil
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbcs_ompl.core.types import Array
from pbcs_ompl.figures.canvas import colour, new_panels

Runs = Mapping[str, Sequence[Mapping[str, Any]]]
"""The records of each planner in one environment; see docs/compare.md."""
MOST_COLUMNS = 3


def distribution_figure(environments: Mapping[str, Runs], *, title: str = "") -> Figure:
    """Draw the share of runs solved within a number of transitions, as [Matheron2020] Fig. 3.9.

    One panel for each environment, in it one step curve for each planner. A run that did not reach the goal never
    counts, so that a curve ends at the planner's solved share; all curves go as far as the longest run.
    """
    return _panels(environments, _draw_distributions, "transitions to the goal", "share of the runs", title)


def coverage_figure(environments: Mapping[str, Runs], *, title: str = "") -> Figure:
    """Draw the share of the cells reached within a number of transitions: the median run and the quartiles.

    One panel for each environment. A run that has ended keeps the share it ended with, and a planner's curve ends with
    its longest run.
    """
    return _panels(environments, _draw_coverage, "transitions", "share of the cells reached", title)


def length_figure(environments: Mapping[str, Runs], *, title: str = "") -> Figure:
    """Draw how long plans are after a number of transitions, those of the search included: median and quartiles.

    As OMPL's benchmarks show the cost of the best solution over time. One panel for each environment. A run without a
    plan yet is infinitely long, so a curve begins where half of the runs have one; it ends with the longest run.
    """
    return _panels(environments, _draw_lengths, "transitions", "steps of the plan", title)


def _panels(environments: Mapping[str, Runs], draw: Callable[[Axes, Runs], None], x: str, y: str, title: str) -> Figure:
    columns = min(MOST_COLUMNS, max(1, len(environments)))
    rows = max(1, ceil(len(environments) / columns))
    figure, grid = new_panels(rows, columns)
    for axes, (name, runs) in zip(grid, environments.items(), strict=False):
        draw(axes, runs)
        axes.set_xscale("log")
        axes.set_xlabel(x)
        axes.set_ylabel(y)
        axes.set_title(f"{name}, {title}" if title else name, fontsize=10)
        axes.grid(alpha=0.3, which="both")
        axes.legend(frameon=False, fontsize=9)
    for axes in grid[len(environments):]:
        axes.set_visible(False)
    return figure


def _draw_distributions(axes: Axes, runs: Runs) -> None:
    solved = {name: np.sort([float(run["transitions"]) for run in some if run["solved"]])
              for name, some in runs.items()}
    spent = [float(run["transitions"]) for some in runs.values() for run in some if run["transitions"]]
    least, most = (min(spent), max(spent)) if spent else (1.0, 10.0)
    for name, found in solved.items():
        total = len(runs[name])
        x = np.concatenate([found[:1], found, [most]]) if len(found) else np.array([least, most])
        y = np.array([0, *range(1, len(found) + 1), len(found)]) / total if len(found) else np.zeros(2)
        axes.step(x, y, where="post", linewidth=2, marker="." if total <= 50 else None,
                  label=f"{name} ({len(found)}/{total} solved)")
    axes.set_ylim(-0.03, 1.03)


def _draw_coverage(axes: Axes, runs: Runs) -> None:
    for number, (name, some) in enumerate(runs.items()):
        curves = [run["progress"] for run in some if run["progress"] is not None]
        if not curves:
            continue
        points = np.unique(np.concatenate([curve["transitions"] for curve in curves]))
        low, middle, high = np.quantile([_held(curve, points) for curve in curves], [0.25, 0.5, 0.75], axis=0)
        axes.plot(points, middle, color=colour(number), linewidth=2, label=f"{name} ({len(curves)} runs)")
        axes.fill_between(points, low, high, color=colour(number), alpha=0.2, linewidth=0)
    axes.set_ylim(bottom=0)


def _draw_lengths(axes: Axes, runs: Runs) -> None:
    for number, (name, some) in enumerate(runs.items()):
        curves = [_lengths(run) for run in some]
        points = np.unique(np.concatenate([reached for reached, _ in curves]))
        if not len(points):
            continue
        steps = np.array([np.append(np.inf, length)[np.searchsorted(reached, points, side="right")]
                          for reached, length in curves])
        low, middle, high = np.quantile(steps, [0.25, 0.5, 0.75], axis=0, method="nearest")
        known = np.isfinite(middle)
        axes.step(points[known], middle[known], where="post", color=colour(number), linewidth=2,
                  label=f"{name} ({len(curves)} runs)")
        axes.fill_between(points[known], low[known], np.where(np.isfinite(high), high, middle)[known], step="post",
                          color=colour(number), alpha=0.2, linewidth=0)
    axes.set_ylim(bottom=0)


def _lengths(run: Mapping[str, Any]) -> tuple[Array, Array]:
    """Return the transitions [K] at which a run had a shorter plan, and its steps [K]; the last where it ended."""
    if not run["solved"]:
        return np.empty(0), np.empty(0)
    note = run.get("improvement")
    if note is None:
        return np.array([float(run["transitions"])]), np.array([float(run["path_length"])])
    transitions = run["transitions"] + np.array([*note["progress"]["transitions"], note["transitions"]], np.float64)
    return transitions, np.array([*note["progress"]["length"], note["after"]], np.float64)


def _held(curve: Mapping[str, Sequence[float]], points: Array) -> Array:
    """Return the coverage at `points` [K]; after the end of the run, what it ended with."""
    return np.interp(points, curve["transitions"], curve["coverage"], left=0.0)
