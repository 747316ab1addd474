"""How do I show a plan growing and the controller that follows it, in one moving picture?

    python examples/moving_picture.py
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from PIL import Image

import pbcs_ompl
from pbcs_ompl.figures.canvas import GREEN, RED
from pbcs_ompl.figures.maze import draw_line, map_axes, project_2d

GROWING, RESTING, RUNNING, COLOURS = 40, 8, 50, 32


def main(size: str = "5", file: str = "runs/plan_and_chain.gif") -> None:
    model = pbcs_ompl.make("pbcs/Maze-v0", {"size": int(size), "maze_seed": 1})
    plan = pbcs_ompl.plan(model, planner="Rides", seed=0)
    if plan.trajectory is None:
        sys.exit("no path was found")
    result = pbcs_ompl.train(model, trajectory=plan.trajectory, seed=0)
    if result.chain is None:
        sys.exit(result.reason)
    rollout = project_2d(model, result.chain.rollout(model, epsilon=0.1, rng=np.random.default_rng(1)))
    nodes, path = project_2d(model, plan.tree.states), project_2d(model, plan.trajectory.states)
    edges = np.stack([nodes[plan.tree.parents[1:]], nodes[1:]], axis=1)

    frames = [frame(model, edges[: int(len(edges) * share**2)], title=f"{plan.planner} explores")
              for share in np.linspace(0.05, 1, GROWING)]
    frames += [frame(model, edges, path, title=f"a plan of {plan.path_length} steps")] * RESTING
    frames += [frame(model, edges[:0], path, rollout[: int(end)], title="the controller, 10 % random actions")
               for end in np.linspace(2, len(rollout), RUNNING)]
    frames += frames[-1:] * 2 * RESTING

    Path(file).parent.mkdir(parents=True, exist_ok=True)
    frames[0].save(file, save_all=True, append_images=frames[1:], duration=80, loop=0, optimize=True)
    print(f"{len(frames)} frames in {file}")


def frame(model, edges, path=None, rollout=None, *, title) -> Image.Image:
    """Return a picture of the tree's edges [N, 2, 2], a path [T+1, 2] and the way so far [t, 2]."""
    figure, axes = map_axes(model, title)
    figure.set_size_inches(4.2, 4.4)
    axes.set_axis_off()
    axes.add_collection(LineCollection(list(edges), colors="#2c7fb8", linewidths=0.6, zorder=1))
    if path is not None:
        draw_line(axes, path, color=RED, linewidth=1.2, zorder=3)
    if rollout is not None:
        draw_line(axes, rollout, color=GREEN, linewidth=2.2, zorder=4)
        axes.plot(*rollout[-1], marker="o", markersize=8, color=GREEN, markeredgecolor="black", zorder=5)
    figure.canvas.draw()
    return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB").quantize(COLOURS)


if __name__ == "__main__":
    main(*sys.argv[1:])
