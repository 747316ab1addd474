"""The stage of every picture: walls, goal and bounds of the first two dimensions of the feature."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from pbcs_ompl.core.errors import Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.figures.canvas import WALL, new_figure

GOAL = "#f1c40f"
ALIKE = 4.0
"""Two dimensions without walls are drawn at equal scale where one extends over up to this many times the other."""


def map_axes(model: ResettableModel, title: str) -> tuple[Figure, Axes]:
    """Return a figure whose axes show the model's walls and goal; see `draw_map`.

    Raises:
        Mismatch: the feature has fewer than two dimensions, so there is no plane to draw.
    """
    figure, axes = new_figure()
    draw_map(axes, model)
    axes.set_title(title, fontsize=10)
    return figure, axes


def draw_map(axes: Axes, model: ResettableModel) -> None:
    """Draw the model's walls and goal into axes: at equal scale, unless the two dimensions seem to have unlike units.

    Raises:
        Mismatch: the feature has fewer than two dimensions.
    """
    if len(model.feature_low) < 2:
        raise Mismatch(f"a picture needs two feature dimensions, {model.spec.id} has {len(model.feature_low)}")
    corners = [Rectangle((x0, y0), x1 - x0, y1 - y0) for x0, y0, x1, y1 in np.reshape(model.walls, (-1, 4))]
    axes.add_collection(PatchCollection(corners, facecolor=WALL, edgecolor="none", zorder=2))
    if model.goal_circle is not None:
        x, y, radius = model.goal_circle
        axes.add_patch(Circle((x, y), radius, facecolor=GOAL, edgecolor="black", linewidth=0.6, zorder=2,
                              label="goal"))
    _frame(axes, model)


def project_2d(model: ResettableModel, states: Array) -> Array:
    """Return where states [B, D] lie in the picture [B, 2]."""
    return model.feature(np.atleast_2d(states))[:, :2]


def draw_line(axes: Axes, points: Array, **style: Any) -> None:
    """Draw points [T+1, 2] as one line, with a dot where it starts."""
    (line,) = axes.plot(points[:, 0], points[:, 1], **style)
    axes.plot(*points[0], marker="o", markersize=5, color=line.get_color(), markeredgecolor="white",
              zorder=line.get_zorder() + 1)


def legend_below(axes: Axes, *, columns: int = 4) -> None:
    """Put the legend under the picture, where it hides nothing."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=columns, frameon=False, fontsize=9)


def _frame(axes: Axes, model: ResettableModel) -> None:
    low, high = model.feature_low[:2], model.feature_high[:2]
    extents = high - low
    planar = len(model.walls) > 0 or model.goal_circle is not None
    equal = planar or extents.max() <= ALIKE * extents.min()
    margin = 0.02 * (np.full(2, extents.max()) if equal else extents)
    axes.set_xlim(low[0] - margin[0], high[0] + margin[0])
    axes.set_ylim(low[1] - margin[1], high[1] + margin[1])
    axes.set_aspect("equal" if equal else "auto")
    for name, label in zip(("x", "y"), ("x", "y") if planar else ("first feature", "second feature"), strict=True):
        axes.set(**{f"{name}label": label})
    axes.tick_params(labelsize=8)
