"""Rates and values of many named rows: names down the side, a panel for each quantity, a colour for each series."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbcs_ompl.core.statistics import median_interval, wilson
from pbcs_ompl.figures.by_group import Rates, Values
from pbcs_ompl.figures.canvas import colour, legend_below, new_panels

ROW_INCHES = 0.42


def rows_figure(rates: Mapping[str, Rates], values: Mapping[str, Values], *, title: str = "") -> Figure:
    """Draw rates with 95 % Wilson intervals, and values as dots with their medians and 95 % bootstrap intervals.

    Args:
        rates: The panels of rates, by the names of their axes; rows stand for groups.
        values: The panels of values, likewise.
        title: Above all.
    """
    rows = list(dict.fromkeys(row for panel in [*rates.values(), *values.values()] for series in panel.values()
                              for row in series))
    count = len(rates) + len(values)
    figure, grid = new_panels(1, count, 3.0 + 2.9 * count, 1.6 + ROW_INCHES * len(rows))
    for axes, (name, counts) in zip(grid, rates.items(), strict=False):
        for series, (label, pairs) in enumerate(counts.items()):
            _draw_rates(axes, {_place(rows.index(row), series, len(counts)): pair for row, pair in pairs.items()},
                        label, colour(series))
        axes.set_xlim(-0.04, 1.04)
        axes.set_xlabel(f"{name}\n(95 % Wilson)")
    for axes, (name, panel) in zip(grid[len(rates):], values.items(), strict=True):
        for series, columns in enumerate(panel.values()):
            _draw_values(axes, {_place(rows.index(row), series, len(panel)): column for row, column in columns.items()},
                         colour(series))
        axes.set_xlabel(f"{name}\n(medians, 95 % bootstrap)")
    for index, axes in enumerate(grid):
        axes.set_yticks(range(len(rows)), rows if index == 0 else [""] * len(rows))
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.grid(alpha=0.3)
    figure.suptitle(title, fontsize=10)
    legend_below(figure)
    return figure


def _draw_rates(axes: Axes, pairs: Mapping[float, tuple[int, int]], label: str, shade: str) -> None:
    """Draw (successes, trials) at their heights."""
    trials = [count for _, count in pairs.values()]
    for place, (successes, count) in pairs.items():
        if count:
            axes.hlines(place, *wilson(successes, count), color=shade, linewidth=1.2)
            axes.plot(successes / count, place, "o", color=shade, markersize=4.5)
    axes.plot([], [], "o", color=shade, label=f"{label} (N = {_range(trials)})")


def _draw_values(axes: Axes, columns: Mapping[float, Sequence[float]], shade: str) -> None:
    """Draw values at their heights."""
    for place, column in columns.items():
        if len(column):
            axes.plot(column, np.full(len(column), place), ".", color=shade, alpha=0.35)
            axes.hlines(place, *median_interval(column), color=shade, linewidth=1.2)
            axes.plot(np.median(column), place, "o", color=shade, markersize=4.5)


def _place(row: int, series: int, count: int) -> float:
    return row + 0.22 * (series - (count - 1) / 2)


def _range(trials: Sequence[int]) -> str:
    low, high = min(trials, default=0), max(trials, default=0)
    return str(low) if low == high else f"{low} to {high}"
