"""How do I find a path in a maze, look at it, and keep it?

    python examples/plan_a_maze.py
"""

import sys
from pathlib import Path

import pbcs_ompl
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.tree import tree_figure


def main(folder: str = "runs/example-plan") -> None:
    maze = {"size": 7, "maze_seed": 3}
    result = pbcs_ompl.plan("pbcs/Maze-v0", planner="Ex", env_kwargs=maze, seed=0)
    if result.trajectory is None:
        sys.exit("not solved: raise max_transitions")
    print(f"solved with {result.transitions:,} transitions: a path of {result.path_length} steps")

    path = Path(folder) / "path.npz"
    result.trajectory.save(path)
    again = pbcs_ompl.Trajectory.load(path)
    model = pbcs_ompl.make("pbcs/Maze-v0", maze)
    print(f"read back from {path}, it replays exactly: {again.replays_exactly(model)}")

    title = f"Ex: {result.transitions:,} transitions"
    figure = tree_figure(model, result.tree.states, result.tree.parents, path=again.states, title=title)
    print(f"picture in {save(figure, Path(folder) / 'tree.png')}")


if __name__ == "__main__":
    main(*sys.argv[1:])
