"""What a critic and a policy believe all over the maze ([Matheron2020] Fig. 4.1)."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from pbcs_ompl.core.errors import Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.figures.canvas import QUANTITIES, RED
from pbcs_ompl.figures.maze import draw_line, legend_below, map_axes

FIELD, ARROWS = 120, 18


def critic_figure(model: ResettableModel, policy: Callable[[Array], Array],
                  critic: Callable[[Array, Array], Array], *, rollout: Array | None = None,
                  title: str = "") -> Figure:
    """Draw Q(s, pi(s)) as a field, pi(s) as white arrows and one rollout [T+1, D] in red.

    Args:
        policy: pi, from observations [B, O] to actions [B, A]; the first two action dimensions are drawn.
        critic: Q, from observations [B, O] and actions [B, A] to values [B].

    Raises:
        Mismatch: the state has other dimensions than the two of the picture.
    """
    if len(model.state_low) != 2:
        raise Mismatch(f"a critic field needs states of two dimensions, {model.spec.id} has "
                       f"{len(model.state_low)}")
    figure, axes = map_axes(model, title)
    states, extent = _grid(model, FIELD)
    observations = model.observe(states)
    values = critic(observations, policy(observations)).reshape(FIELD, FIELD)
    field = axes.imshow(values, origin="lower", extent=extent, cmap=QUANTITIES, zorder=0,
                        interpolation="bilinear")
    figure.colorbar(field, ax=axes, shrink=0.7, pad=0.02, label="Q(s, π(s))")
    states, _ = _grid(model, ARROWS)
    free = states[model.is_valid(states)]
    actions = policy(model.observe(free))
    axes.quiver(free[:, 0], free[:, 1], actions[:, 0], actions[:, 1], color="white", width=0.003, zorder=3)
    if rollout is not None:
        draw_line(axes, rollout[:, :2], color=RED, linewidth=1.6, zorder=4,
                  label=f"rollout, {len(rollout) - 1} steps")
    legend_below(axes)
    return figure


def _grid(model: ResettableModel, count: int) -> tuple[Array, tuple[float, float, float, float]]:
    """Return the centres [count**2, 2] of a grid of cells over the state bounds, row by row; its extent."""
    low, high = model.state_low, model.state_high
    middle = (np.arange(count) + 0.5) / count
    x, y = np.meshgrid(low[0] + middle * (high[0] - low[0]), low[1] + middle * (high[1] - low[1]))
    return np.stack([x.ravel(), y.ravel()], axis=1), (low[0], high[0], low[1], high[1])
