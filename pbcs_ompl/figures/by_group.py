"""Rates and values side by side: one group for each setting or size, one colour for each series."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbcs_ompl.core.statistics import median_interval, wilson
from pbcs_ompl.figures.canvas import colour, legend_below, new_figure

Rates = Mapping[str, Mapping[str, tuple[int, int]]]
"""For each series the (successes, trials) of each group."""
Values = Mapping[str, Mapping[str, Sequence[float]]]
"""For each series the values of each group."""


def rates_figure(rates: Rates, *, title: str = "", xlabel: str = "", ylabel: str = "share of solved runs") -> Figure:
    """Draw rates with 95 % Wilson intervals; see `draw_rates`."""
    figure, axes = new_figure(7.2, 4.6)
    draw_rates(axes, rates, ylabel=ylabel)
    _finish(figure, axes, title, xlabel)
    return figure


def values_figure(values: Values, *, title: str = "", xlabel: str = "", ylabel: str = "", log: bool = False) -> Figure:
    """Draw values with their medians; see `draw_values`."""
    figure, axes = new_figure(7.2, 4.6)
    draw_values(axes, values, ylabel=ylabel, log=log)
    _finish(figure, axes, title, xlabel)
    return figure


def draw_rates(axes: Axes, rates: Rates, *, ylabel: str = "share of solved runs") -> None:
    """Draw rates with 95 % Wilson intervals into axes."""
    places = _places(axes, rates)
    for index, (name, groups) in enumerate(rates.items()):
        counts = [(at, *groups[group]) for group, at in places[name].items() if groups[group][1]]
        if not counts:
            continue
        shares = np.array([successes / trials for _, successes, trials in counts])
        bounds = np.array([wilson(successes, trials) for _, successes, trials in counts]).T
        axes.errorbar([at for at, _, _ in counts], shares, np.abs(bounds - shares), fmt="o", capsize=3, linewidth=1.4,
                      color=colour(index), label=f"{name} (N = {_range([trials for _, _, trials in counts])})")
    axes.set_ylim(-0.04, 1.04)
    axes.set_ylabel(f"{ylabel} (95 % Wilson)")
    axes.grid(alpha=0.3, axis="y")


def draw_values(axes: Axes, values: Values, *, ylabel: str = "", log: bool = False) -> None:
    """Draw the value of each run as a dot, and medians as bars with their 95 % bootstrap intervals, into axes.

    Args:
        axes: Where.
        values: The values.
        ylabel: What they are.
        log: Whether the values' axis is logarithmic.
    """
    places = _places(axes, values)
    for index, (name, groups) in enumerate(values.items()):
        filled = {at: groups[group] for group, at in places[name].items() if len(groups[group])}
        if not filled:
            continue
        for at, column in filled.items():
            axes.plot(np.full(len(column), at), column, ".", color=colour(index), alpha=0.35)
        axes.vlines(list(filled), *np.transpose([median_interval(column) for column in filled.values()]),
                    color=colour(index), linewidth=1.4)
        axes.plot(list(filled), [np.median(column) for column in filled.values()], "_", color=colour(index),
                  markersize=14, markeredgewidth=2.5,
                  label=f"{name} (N = {_range([len(column) for column in filled.values()])})")
    if log:
        axes.set_yscale("log")
    axes.set_ylabel(f"{ylabel}\n(bars: medians, 95 % bootstrap)")
    axes.grid(alpha=0.3, axis="y")


def _places(axes: Axes, series: Mapping[str, Mapping[str, object]]) -> dict[str, dict[str, float]]:
    """Label the groups along the axis; return where each group of each series goes."""
    groups = list(dict.fromkeys(group for one in series.values() for group in one))
    axes.set_xticks(range(len(groups)), groups)
    axes.set_xlim(-0.6, len(groups) - 0.4)
    offsets = 0.16 * (np.arange(len(series)) - (len(series) - 1) / 2)
    return {name: {group: groups.index(group) + float(offset) for group in one}
            for (name, one), offset in zip(series.items(), offsets, strict=True)}


def _range(counts: Sequence[int]) -> str:
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low} to {high}"


def _finish(figure: Figure, axes: Axes, title: str, xlabel: str) -> None:
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(xlabel)
    legend_below(figure)
