"""Curves over training and slices of critics: what the diagnostics look like."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.figures.canvas import BAND, QUANTITIES, RED, new_figure, new_panels


def success_figure(curves: Mapping[str, tuple[IndexArray, BoolArray]], *, title: str = "",
                   xlabel: str = "steps of each seed") -> Figure:
    """Draw the share of solved seeds over the steps, with 95 % Wilson intervals ([Matheron2020] Fig. 6.2).

    Args:
        curves: For each variant the steps [E] and which seeds were solved then [E, S].
    """
    figure, axes = new_figure(7.2, 4.6)
    for name, (steps, success) in curves.items():
        seeds = success.shape[1]
        low, high = np.transpose([wilson(int(count), seeds) for count in success.sum(axis=1)])
        (line,) = axes.plot(steps, success.mean(axis=1), linewidth=2, label=f"{name} (N = {seeds})")
        axes.fill_between(steps, low, high, color=line.get_color(), alpha=BAND, linewidth=0)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlabel(xlabel)
    axes.set_ylabel("share of solved seeds (95 % Wilson)")
    axes.set_title(title, fontsize=10)
    axes.grid(alpha=0.3)
    if curves:
        figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=9)
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


def slices_figure(actions: Array, slices: Mapping[str, Array], chosen: Mapping[str, float], *, title: str = "",
                  ylim: tuple[float, float] | None = None) -> Figure:
    """Draw Q along one dimension of the action, and where the actor is ([Matheron2020] Figs. 6.5b and 6.9b).

    Args:
        actions: The actions [N].
        slices: Q in some states [N], by what to call them.
        chosen: The actor's action in the same states.
        ylim: The range of Q to show; all of it by default.
    """
    figure, axes = new_figure(6.4, 4.6)
    for name, values in slices.items():
        (line,) = axes.plot(actions, values, linewidth=2, label=name)
        axes.plot(chosen[name], np.interp(chosen[name], actions, values), marker="o", color=line.get_color())
    axes.set_xlabel("action (the dots: the actor's)")
    axes.set_ylabel("Q")
    if ylim is not None:
        axes.set_ylim(*ylim)
    _finish(axes, title)
    return figure


def critic_map_figure(states: Array, actions: Array, values: Array, chosen: Array, *, title: str = "") -> Figure:
    """Draw Q over a line of states and one dimension of the action, and the actor's way ([Matheron2020] Fig. 6.5a).

    Args:
        states, actions: [N] and [M].
        values: Q [N, M].
        chosen: The actor's actions [N].
    """
    figure, axes = new_figure(6.4, 4.6)
    mesh = axes.pcolormesh(states, actions, values.T, shading="nearest", cmap=QUANTITIES)
    figure.colorbar(mesh, ax=axes, label="Q")
    axes.plot(states, chosen, color=RED, linewidth=2, label="actor")
    axes.set_xlabel("state")
    axes.set_ylabel("action")
    axes.set_title(title, fontsize=10)
    axes.legend(frameon=False, fontsize=9, labelcolor="white")
    return figure


def _finish(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=10)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=9)
