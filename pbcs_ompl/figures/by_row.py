"""Rates and values of many named rows: the names down the side, one panel for each quantity, one colour for each series."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbcs_ompl.core.statistics import median_interval, wilson
from pbcs_ompl.figures.canvas import colour, new_panels

Rates = Mapping[str, Mapping[str, tuple[int, int]]]
"""For each series the (successes, trials) of each row."""
Values = Mapping[str, Mapping[str, Sequence[float]]]
"""For each series the values of each row."""
ROW_INCHES = 0.42


def rows_figure(rates: Mapping[str, Rates], values: Mapping[str, Values], *, title: str = "",
                log: Sequence[str] = ()) -> Figure:
    """Draw rates with 95 % Wilson intervals, and values as dots with their medians and 95 % bootstrap intervals.

    Args:
        rates: The panels of rates, by the names of their axes.
        values: The panels of values, by the names of their axes.
        title: Above all.
        log: The names of the panels of values whose axis is logarithmic.
    """
    panels = [*rates.values(), *values.values()]
    rows = list(dict.fromkeys(row for panel in panels for series in panel.values() for row in series))
    figure, grid = new_panels(1, len(panels), 3.0 + 2.9 * len(panels), 1.6 + ROW_INCHES * len(rows))
    for axes, (name, panel) in zip(grid, rates.items(), strict=False):
        for series, (label, columns) in enumerate(panel.items()):
            for row, (successes, trials) in columns.items():
                if trials:
                    _mark(axes, _place(rows.index(row), series, len(panel)), successes / trials,
                          wilson(successes, trials), series)
            axes.plot([], [], "o", color=colour(series), label=f"{label} (N = {_counts([n for _, n in columns.values()])})")
        axes.set_xlim(-0.04, 1.04)
        axes.set_xlabel(f"{name} (95 % Wilson)")
    for axes, (name, panel) in zip(grid[len(rates):], values.items(), strict=True):
        for series, columns in enumerate(panel.values()):
            for row, column in columns.items():
                if len(column):
                    place = _place(rows.index(row), series, len(panel))
                    axes.plot(column, np.full(len(column), place), ".", color=colour(series), alpha=0.35)
                    _mark(axes, place, float(np.median(column)), median_interval(column), series)
        axes.set_xscale("log" if name in log else "linear")
        axes.set_xlabel(f"{name}\n(medians, 95 % bootstrap)")
    for index, axes in enumerate(grid):
        axes.set_yticks(range(len(rows)), rows if index == 0 else [""] * len(rows))
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.grid(alpha=0.3)
    figure.suptitle(title, fontsize=10)
    figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure


def _mark(axes: Axes, place: float, middle: float, ends: tuple[float, float], series: int) -> None:
    axes.hlines(place, *ends, color=colour(series), linewidth=1.2)
    axes.plot(middle, place, "o", color=colour(series), markersize=4.5)


def _place(row: int, series: int, count: int) -> float:
    return row + 0.22 * (series - (count - 1) / 2)


def _counts(trials: Sequence[int]) -> str:
    low, high = min(trials, default=0), max(trials, default=0)
    return str(low) if low == high else f"{low} to {high}"
