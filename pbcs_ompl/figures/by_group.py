"""Rates and values side by side: one group for each setting or size, one colour for each series."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbcs_ompl.core.statistics import median_interval, wilson
from pbcs_ompl.figures.canvas import colour, new_figure


def rates_figure(rates: Mapping[str, Mapping[str, tuple[int, int]]], *, title: str = "", xlabel: str = "",
                 ylabel: str = "share of solved runs") -> Figure:
    """Draw rates with 95 % Wilson intervals.

    Args:
        rates: For each series the (successes, trials) of each group.
    """
    figure, axes = new_figure(7.2, 4.6)
    places = _places(axes, rates)
    for name, groups in rates.items():
        counts = [(at, *groups[group]) for group, at in places[name].items() if groups[group][1]]
        if not counts:
            continue
        shares = np.array([successes / trials for _, successes, trials in counts])
        bounds = np.array([wilson(successes, trials) for _, successes, trials in counts]).T
        axes.errorbar([at for at, _, _ in counts], shares, np.abs(bounds - shares), fmt="o", capsize=3, linewidth=1.4,
                      label=f"{name} (N = {_range([trials for _, _, trials in counts])})")
    axes.set_ylim(-0.04, 1.04)
    _finish(figure, axes, title, xlabel, f"{ylabel} (95 % Wilson)")
    return figure


def values_figure(values: Mapping[str, Mapping[str, Sequence[float]]], *, title: str = "", xlabel: str = "",
                  ylabel: str = "", log: bool = False) -> Figure:
    """Draw the value of each run as a dot, and medians as bars with their 95 % bootstrap intervals.

    Args:
        values: For each series the values of each group.
        log: Whether the values' axis is logarithmic.
    """
    figure, axes = new_figure(7.2, 4.6)
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
    _finish(figure, axes, title, xlabel, f"{ylabel} (bars: medians, 95 % bootstrap)")
    return figure


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


def _finish(figure: Figure, axes: Axes, title: str, xlabel: str, ylabel: str) -> None:
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.grid(alpha=0.3, axis="y")
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
