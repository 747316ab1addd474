"""How many transitions each planner needs: empirical distributions over the seeds."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from pbcs_ompl.figures.canvas import new_figure


def compare_figure(transitions: Mapping[str, Sequence[float | None]], *, title: str = "") -> Figure:
    """Draw the share of runs solved within a number of transitions, one step curve for each planner.

    Args:
        transitions: For each planner, the transitions of each run up to the goal; None for a run that did
            not reach it, so that a curve ends at the planner's solved share.
    """
    figure, axes = new_figure(7.2, 4.6)
    solved = {name: np.sort([float(n) for n in runs if n is not None]) for name, runs in transitions.items()}
    everything = np.concatenate([np.empty(0), *solved.values()])
    least, most = (everything.min(), everything.max()) if len(everything) else (1.0, 10.0)
    for name, found in solved.items():
        runs = len(transitions[name])
        x = np.concatenate([found[:1], found, [most]]) if len(found) else np.array([least, most])
        y = np.array([0, *range(1, len(found) + 1), len(found)]) / runs if len(found) else np.zeros(2)
        axes.step(x, y, where="post", linewidth=2, marker="." if runs <= 50 else None,
                  label=f"{name} ({len(found)}/{runs} solved)")
    axes.set_xscale("log")
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlabel("transitions to the goal")
    axes.set_ylabel("share of the runs")
    axes.set_title(title, fontsize=10)
    axes.grid(alpha=0.3, which="both")
    axes.legend(frameon=False, fontsize=9)
    return figure
