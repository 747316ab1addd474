"""How fast is Ex? Every number is a ratio, or stands beside one, measured in this run on this machine.

    python tests/benchmarks/ex_speed.py [--quick]

1. Propagations per second on a 15x15 maze: Ex through `plan`, OMPL's KPIECE1 through `plan`, and KPIECE1 on a plain
   OMPL problem with the leanest Python propagator and no validity callback. Bar: 7 times the faster KPIECE1.
2. Ex's rate near 1e5, 1e6 and 1e7 nodes on a 15x15 maze whose goal is walled in (bar: within 25 %), and bytes a node
   (bar: 110).
3. Ten 9x9 mazes: median wall time to the first solution of Ex and of OMPL's planners. These get the plain problem, and
   the goal as a GoalState, so that those with a goal bias know where it is. Bar: 1/50 of the fastest at OMPL's default
   projection (cells of 1/20 of the extent). Beside it, OMPL's planners with projection cells as small as Ex's bins,
   which they profit from.
"""

import argparse
import resource
import time
from statistics import median
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import control as oc
from ompl import util as ou

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.core.errors import PlannerUnavailable
from pbcs_ompl.core.registry import load
from pbcs_ompl.core.types import Counter
from pbcs_ompl.envs.maze.layout import MazeLayout
from pbcs_ompl.planners import Ex
from pbcs_ompl.resettable import make

MAZE = "pbcs/Maze-v0"
STOCK = ("RRT", "EST", "KPIECE1", "SyclopRRT", "SyclopEST", "SST", "PDST")


def walled_in(size: int) -> dict[str, Any]:
    """Return the options of a maze whose goal cannot be reached."""
    layout = MazeLayout.from_size(size, 0)
    last = size - 1
    layout.vertical[last, last] = layout.horizontal[last, last] = True
    return {"layout": layout.draw()}


def plain_problem(model: Any, cells: Any, threshold: float) -> tuple[Any, list[int]]:
    """Return a plain OMPL problem around `step_one`, its projection in `cells` [2], and its propagations."""
    space = ob.RealVectorStateSpace(2)
    box = ob.RealVectorBounds(2)
    box.setLow(0.0)
    box.setHigh(float(model.state_high[0]))
    space.setBounds(box)
    space.registerDefaultProjection(ob.RealVectorOrthogonalProjectionEvaluator(space, list(cells), [0, 1]))
    controls = oc.RealVectorControlSpace(space, 2)
    limits = ob.RealVectorBounds(2)
    limits.setLow(float(model.action_low[0]))
    limits.setHigh(float(model.action_high[0]))
    controls.setBounds(limits)
    setup = oc.SimpleSetup(controls)
    count, step_one = [0], model.step_one

    def propagate(state: Any, control: Any, duration: float, result: Any) -> None:
        count[0] += 1
        result[0:2] = step_one(state[0:2], [control[0], control[1]])

    setup.setStatePropagator(propagate)
    information = setup.getSpaceInformation()
    information.setPropagationStepSize(1.0)
    information.setMinMaxControlDuration(1, 1)
    start, goal = information.allocState(), information.allocState()
    start[0:2] = model.initial_state().tolist()
    goal[0:2] = list(model.goal_circle[:2])
    setup.setStartAndGoalStates(start, goal, threshold)
    return setup, count


def plain_rate(name: str, size: int, seconds: float) -> float:
    """Return the propagations per second of one of OMPL's planners on an endless plain problem."""
    ou.RNG.setSeed(1)
    model = make(MAZE, {"size": size})
    setup, count = plain_problem(model, model.bin_size, 1e-12)
    setup.setPlanner(load("planner", name).build(setup.getSpaceInformation(), seed=1))
    setup.setup()
    began = time.perf_counter()
    setup.solve(seconds)
    return count[0] / (time.perf_counter() - began)


def plan_rate(name: str, size: int, seed: int, transitions: int) -> float:
    """Return the propagations per second of a planner through `plan`, until the budget or the goal."""
    maze = {"size": size, "maze_seed": seed}
    result = plan(MAZE, name, env_kwargs=maze, seed=seed, max_transitions=transitions)
    return result.transitions / result.seconds


def compare_rates(size: int, quick: bool) -> None:
    """Print the first table; the planners take turns, so that a busy machine slows them all."""
    plan(MAZE, "Ex", env_kwargs={"size": 2})  # compile
    ex, plain, bridged = [], [], []
    for seed in range(3 if quick else 7):
        ex.append(plan_rate("Ex", size, seed, 1_000_000))
        plain.append(plain_rate("KPIECE1", size, 0.2))
        bridged.append(plan_rate("KPIECE1", size, seed, 50_000))
    print(f"propagations per second, {size}x{size} maze, median of {len(ex)} turns")
    for name, rates in (("Ex, plan() to the first solution", ex), ("KPIECE1, plain OMPL", plain),
                        ("KPIECE1, plan()", bridged)):
        print(f"  {name:<34}{median(rates):>12,.0f}")
    print(f"  Ex / the faster KPIECE1: {median(ex) / max(median(plain), median(bridged)):.1f}  (bar 7)")


def growing_tree(size: int, nodes: list[int]) -> None:
    """Print the second table."""
    model = make(MAZE, walled_in(size))
    counter, rates = Counter(nodes[-1]), {}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with make_problem(model, counter=counter) as problem:
        planner = Ex.build(problem.space_information)
        planner.use_model(model, counter)
        problem.setup.setPlanner(planner)
        problem.setup.setup()
        for goal in nodes:
            grow(planner, counter, int(0.8 * goal))
            began, first = time.perf_counter(), counter.count
            grow(planner, counter, goal)
            rates[goal] = (counter.count - first) / (time.perf_counter() - began)
        peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        count = len(planner.tree)
        print(f"Ex on a {size}x{size} maze without a reachable goal")
        for goal, rate in rates.items():
            share = rate / rates[nodes[0]]
            print(f"  rate near {goal:>10,} nodes {rate:>12,.0f} /s   {share:.2f} of the first  (bar .75)")
        print(f"  bytes a node: {(planner.tree.nbytes + planner.strategy.nbytes) / count:.0f} in arrays, "
              f"{peak / count:.0f} of peak resident memory  (bar 110)")


def grow(planner: Any, counter: Counter, nodes: int) -> None:
    """Let the planner make transitions until there are `nodes`."""
    planner.solve(ob.PlannerTerminationCondition(lambda: counter.count >= nodes))
    if planner.error is not None:
        raise planner.error


def first_solutions(size: int, mazes: int, cap: float) -> None:
    """Print the third table."""
    ex = median(plan(MAZE, "Ex", env_kwargs={"size": size, "maze_seed": seed}, seed=seed).seconds
                for seed in range(mazes))
    print(f"median wall seconds to the first solution, {mazes} mazes {size}x{size}, capped at {cap:.0f}")
    print(f"  {'Ex':<10}{ex:>9.4f}\n  {'':<10}{'OMPL default cells':>30}{'cells as bins of Ex':>30}")
    best = {0.05 * size: np.inf, 0.1: np.inf}
    for name in STOCK:
        try:
            texts = []
            for cell in best:
                times = [plain_solution(name, size, seed, cell, cap) for seed in range(mazes)]
                best[cell] = min(best[cell], median(times))
                solved = sum(seconds < cap for seconds in times)
                texts.append(f"{median(times):>10.4f} {median(times) / ex:>5.0f} x Ex, {solved:>2} solved")
            print(f"  {name:<10}{texts[0]:>30}{texts[1]:>30}")
        except PlannerUnavailable:
            print(f"  {name:<10}{'not offered by the installed OMPL':>60}")
    default, small = best.values()
    print(f"  fastest of OMPL / Ex: {default / ex:.0f} with default cells (bar 50), "
          f"{small / ex:.1f} with Ex's bins")


def plain_solution(name: str, size: int, maze_seed: int, cell: float, cap: float) -> float:
    """Return the wall seconds to the first exact solution, `cap` if there was none."""
    ou.RNG.setSeed(maze_seed + 1)
    setup, _ = plain_problem(make(MAZE, {"size": size, "maze_seed": maze_seed}), [cell, cell], 0.2)
    setup.setPlanner(load("planner", name).build(setup.getSpaceInformation(), seed=maze_seed + 1))
    setup.setup()
    began = time.perf_counter()
    setup.solve(cap)
    return time.perf_counter() - began if setup.haveExactSolutionPath() else cap


def main() -> None:
    """Run all three."""
    parser = argparse.ArgumentParser(description="Measure Ex against OMPL's planners.")
    parser.add_argument("--quick", action="store_true", help="trees up to 1e6 nodes, three mazes, short runs")
    quick = parser.parse_args().quick
    ou.setLogLevel(ou.LOG_NONE)
    compare_rates(15, quick)
    growing_tree(15, [10**5, 10**6] if quick else [10**5, 10**6, 10**7])
    first_solutions(9, 3 if quick else 10, 1.0 if quick else 5.0)


if __name__ == "__main__":
    main()
