"""Curves over training and slices of critics: what the diagnostics look like."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.figures.canvas import BAND, QUANTITIES, RED, colour, legend_below, new_panels

HALF = 0.5
"""Where all rates but the first are above this one, the scale begins here."""
ENLARGED, SMALLEST_SPAN = 0.02, 1e-3
"""An enlarged slice shows this share of the range of Q on each side of the actor's values, or the second number."""


Curves = Mapping[str, tuple[IndexArray, BoolArray]]
"""For each variant the steps [E] and which seeds were solved then [E, S]."""


def success_figure(panels: Mapping[str, Curves], *, title: str = "", xlabel: str = "steps of each seed") -> Figure:
    """Draw the share of solved seeds over the steps, with 95 % Wilson intervals ([Matheron2020] Figs. 6.2 and 6.10).

    Args:
        panels: The curves of each panel, by its title. A variant has one colour in all panels.
        title: Above all.
        xlabel: What the steps are.
    """
    names = list(dict.fromkeys(name for curves in panels.values() for name in curves))
    later = [wilson(int(count), success.shape[1])[0] for curves in panels.values() for _, success in curves.values()
             for count in success.sum(axis=1)[1:]]
    figure, grid = new_panels(1, len(panels), max(7.2, 5.2 * len(panels)), 4.4)
    for axes, (words, curves) in zip(grid, panels.items(), strict=True):
        for name, (steps, success) in curves.items():
            seeds, shade = success.shape[1], colour(names.index(name))
            low, high = np.transpose([wilson(int(count), seeds) for count in success.sum(axis=1)])
            axes.plot(steps, success.mean(axis=1), color=shade, linewidth=2, label=f"{name} (N = {seeds})")
            axes.fill_between(steps, low, high, color=shade, alpha=BAND, linewidth=0)
        axes.set_ylim(HALF if later and min(later) > HALF else -0.02, 1.02)
        axes.set_xlabel(xlabel)
        axes.set_title(words, fontsize=10)
        axes.grid(alpha=0.3)
    grid[0].set_ylabel("share of solved seeds (95 % Wilson)")
    figure.suptitle(title, fontsize=10)
    legend_below(figure)
    return figure


def curves_figure(steps: Array, panels: Mapping[str, Array], *, title: str = "", xlabel: str = "updates") -> Figure:
    """Draw one panel for each quantity [E, S], one line for each seed ([Matheron2020] Fig. 6.4)."""
    figure, grid = new_panels(1, len(panels), max(6.4, 4.2 * len(panels)), 3.8)
    for axes, (name, values) in zip(grid, panels.items(), strict=True):
        axes.plot(steps, values, linewidth=1)
        axes.set_xlabel(xlabel)
        axes.set_title(f"{name} (N = {values.shape[1]})", fontsize=10)
        axes.grid(alpha=0.3)
    figure.suptitle(title, fontsize=10)
    return figure


def stuck_critic_figure(states: Array, actions: Array, values: Array, chosen: Array, *, sliced: Sequence[float],
                        title: str = "") -> Figure:
    """Draw Q over a line of states and one dimension of the action, and slices of it, whole and enlarged.

    These are [Matheron2020] Figs. 6.5(a), 6.5(b) and 6.9(b).

    Args:
        states, actions: [N] and [M].
        values: Q [N, M].
        chosen: The actor's actions [N].
        sliced: The states whose slices are drawn: the nearest ones.
        title: Above all.
    """
    figure, (whole, slices, enlarged) = new_panels(1, 3, 14.4, 4.2)
    mesh = whole.pcolormesh(states, actions, values.T, shading="nearest", cmap=QUANTITIES)
    figure.colorbar(mesh, ax=whole, label="Q")
    whole.plot(states, chosen, color=RED, linewidth=2, label="actor")
    whole.set(xlabel="state", ylabel="action")
    whole.set_title("(a) Q(s, a)", fontsize=10)
    whole.legend(frameon=False, fontsize=9, labelcolor="white")
    rows = [int(np.abs(states - state).argmin()) for state in sliced]
    for axes in (slices, enlarged):
        for row in rows:
            (line,) = axes.plot(actions, values[row], linewidth=2, label=f"s = {states[row]:g}")
            axes.plot(chosen[row], np.interp(chosen[row], actions, values[row]), marker="o", color=line.get_color())
        axes.set(xlabel="action (dots: the actor's)", ylabel="Q")
        axes.locator_params(axis="x", nbins=5)
        axes.grid(alpha=0.3)
    slices.set_title("(b) Q(s, ·)", fontsize=10)
    slices.legend(frameon=False, fontsize=9)
    ends = [float(np.interp(chosen[row], actions, values[row])) for row in rows]
    span = max(SMALLEST_SPAN, ENLARGED * float(np.ptp(values)))
    enlarged.set_ylim(min(ends) - span, max(ends) + span)
    enlarged.set_title("(c) enlarged around the actor", fontsize=10)
    figure.suptitle(title, fontsize=10)
    return figure
