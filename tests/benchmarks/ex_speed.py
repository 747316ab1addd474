"""How fast are Ex and Rides in compiled loops, at any size of the tree, and what does a node cost?

    python tests/benchmarks/ex_speed.py [--quick]

Transitions per second near 1e5, 1e6 and 1e7 nodes on a 15x15 maze whose goal is walled in, and bytes a node (bar: 60).
CPU seconds; each rate is the best of several slices, because other work on the machine can only lower it. How our
planners compare with OMPL's is measured by native_ompl/bench.py.
"""

import argparse
import resource
import time
from dataclasses import replace
from typing import Any

from ompl import base as ob

from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.core.registry import load
from pbcs_ompl.core.types import Counter
from pbcs_ompl.envs.maze.layout import MazeLayout
from pbcs_ompl.resettable import make

MAZE = "pbcs/Maze-v0"
SLICES = 20


def walled_in(size: int) -> dict[str, Any]:
    """Return the options of a maze whose goal cannot be reached."""
    layout = MazeLayout.from_size(size, 0)
    last = size - 1
    vertical, horizontal = layout.vertical.copy(), layout.horizontal.copy()
    vertical[last, last] = horizontal[last, last] = True
    return {"layout": replace(layout, vertical=vertical, horizontal=horizontal).draw()}


def growing_tree(name: str, size: int, sizes: list[int]) -> None:
    """Print the rates of a planner near the sizes of its tree, and the bytes of a node."""
    model = make(MAZE, walled_in(size))
    counter, rates = Counter(sizes[-1]), {}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with make_problem(model, counter=counter) as problem:
        planner = load("planner", name).build(problem.space_information, seed=0)
        planner.use_model(model, counter)
        problem.setup.setPlanner(planner)
        problem.setup.setup()
        for nodes in sizes:
            grow(planner, counter, int(0.8 * nodes))
            rates[nodes] = max(rate(planner, counter, nodes // (5 * SLICES)) for _ in range(SLICES))
        peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        count = len(planner.tree)
        print(f"{name} on a {size}x{size} maze without a reachable goal")
        for nodes, best in rates.items():
            print(f"  rate near {nodes:>10,} nodes {best:>12,.0f} /s   {best / rates[sizes[0]]:.2f} of the first")
        print(f"  bytes a node: {(planner.tree.nbytes + planner.strategy.nbytes) / count:.0f} in arrays, "
              f"{peak / count:.0f} of peak resident memory  (bar 60)")


def grow(planner: Any, counter: Counter, nodes: int) -> None:
    """Let the planner make transitions until there are `nodes`."""
    planner.solve(ob.PlannerTerminationCondition(lambda: counter.count >= nodes))
    if planner.error is not None:
        raise planner.error


def rate(planner: Any, counter: Counter, transitions: int) -> float:
    """Return the transitions per CPU second of the next ones."""
    first, began = counter.count, time.thread_time()
    grow(planner, counter, first + transitions)
    return (counter.count - first) / (time.thread_time() - began)


def main() -> None:
    """Measure both planners."""
    parser = argparse.ArgumentParser(description="Measure the compiled loops of Ex and Rides.")
    parser.add_argument("--quick", action="store_true", help="trees up to 1e6 nodes")
    quick = parser.parse_args().quick
    for name in ("Ex", "Rides"):
        growing_tree(name, 15, [10**5, 10**6] if quick else [10**5, 10**6, 10**7])


if __name__ == "__main__":
    main()
