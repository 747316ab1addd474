"""A trained controller: the plan, its rollout, the activation sets of a chain ([Matheron2020] Fig. 7.4)."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.figures.canvas import GREEN, PURPLE, RED
from pbcs_ompl.figures.maze import draw_line, legend_below, map_axes, project_2d


def chain_figure(model: ResettableModel, *, trajectory: Array | None, rollout: Array | None,
                 activations: Sequence[tuple[Array, float]], title: str = "") -> Figure:
    """Draw the planned trajectory [T+1, D], one rollout [T+1, D] of the chain and its activation sets.

    Args:
        model: Where they are.
        trajectory, rollout: None where there is none.
        activations: Centre (a state [D]) and radius of each skill's activation set.
        title: Above the picture.
    """
    figure, axes = map_axes(model, title)
    draw_chain(axes, model, trajectory=trajectory, rollout=rollout, activations=activations)
    legend_below(axes)
    return figure


def draw_chain(axes: Axes, model: ResettableModel, *, trajectory: Array | None, rollout: Array | None,
               activations: Sequence[tuple[Array, float]]) -> None:
    """Draw what `chain_figure` does, into axes that show the model's map; see there for the arguments."""
    if trajectory is not None:
        draw_line(axes, project_2d(model, trajectory), color=RED, linewidth=0.9, alpha=0.8, zorder=3,
                  label=f"planned, {len(trajectory) - 1} steps")
    if rollout is not None:
        draw_line(axes, project_2d(model, rollout), color=GREEN, linewidth=2, zorder=4,
                  label=f"controller, {len(rollout) - 1} steps")
    label: str | None = f"{len(activations)} activation set{'s' if len(activations) > 1 else ''}"
    for centre, radius in activations:
        x, y = project_2d(model, centre)[0]
        axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=PURPLE, linewidth=1.8, zorder=5,
                              label=label))
        label = None  # one line in the legend stands for all circles
