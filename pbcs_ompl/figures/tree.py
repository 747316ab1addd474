"""An exploration tree, coloured by depth, with the path that was found ([Matheron2020] Figs. 4.2 and 4.3)."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.figures.canvas import QUANTITIES, RED
from pbcs_ompl.figures.maze import GOAL, draw_line, legend_below, map_axes, project_2d

MOST_EDGES = 100_000


def tree_figure(model: ResettableModel, states: Array, parents: NDArray[np.integer[Any]], *, path: Array | None = None,
                title: str = "") -> Figure:
    """Draw a tree of states [N, D] with parents [N] (a root's parent is -1), and a path [T+1, D] in red.

    A tree of more than 100 000 nodes is thinned evenly; the title says so.
    """
    figure, axes = map_axes(model, title)
    lines, thinned = draw_tree(axes, model, states, parents, path=path)
    axes.set_title(f"{title}\n{thinned}" if thinned else title, fontsize=10)
    if len(lines.get_segments()):
        figure.colorbar(lines, ax=axes, shrink=0.7, pad=0.02, label="depth in the tree")
    legend_below(axes)
    return figure


def draw_tree(axes: Axes, model: ResettableModel, states: Array, parents: NDArray[np.integer[Any]], *,
              path: Array | None = None) -> tuple[LineCollection, str]:
    """Draw a tree and a path as `tree_figure` does, into axes.

    Returns:
        The edges, for a bar of colours, and how many were drawn where it is not all of them.
    """
    edges = np.flatnonzero(parents >= 0)
    drawn = edges[:: -(-len(edges) // MOST_EDGES)] if len(edges) > MOST_EDGES else edges
    points = project_2d(model, states)
    lines = LineCollection(list(np.stack([points[parents[drawn]], points[drawn]], axis=1)),
                           array=depth(parents)[drawn], cmap=QUANTITIES, linewidths=0.7, zorder=1)
    axes.add_collection(lines)
    if path is not None:
        draw_line(axes, project_2d(model, path), color=RED, linewidth=1.6, zorder=4,
                  label=f"path, {len(path) - 1} steps")
        if model.goal_circle is None:
            axes.plot(*project_2d(model, path[-1:])[0], marker="*", markersize=11, color=GOAL, markeredgecolor="black",
                      markeredgewidth=0.6, linestyle="none", zorder=5, label="its end")
    return lines, f"({len(drawn):,} of {len(edges):,} edges drawn)" if len(drawn) < len(edges) else ""


def depth(parents: NDArray[np.integer[Any]]) -> IndexArray:
    """Return the depth [N] of each node below its root, by doubling: every round jumps twice as far."""
    ancestors = np.where(parents < 0, np.arange(len(parents)), parents)
    depths = (parents >= 0).astype(np.int64)
    while True:
        jump = depths[ancestors]
        if not jump.any():
            return depths
        depths = depths + jump
        ancestors = ancestors[ancestors]
