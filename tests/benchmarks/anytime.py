"""How long are plans after 1, 2, 5 and 10 times the transitions that Rides needs for its first one?

    python tests/benchmarks/anytime.py [5x5] [9x9] [15x15] [MountainCar] [CarPark] [Quadrotor]
                                       [--first-seed 8000] [--seeds 20] [--improved Rides]

Planners that continue after their first solution (SSTCompiled, RidesSST) beside searches whose plan is made shorter
afterwards (`--improve`). The unit of the budgets is what Rides needs with the same seed. In mazes lengths are divided
by the least number of steps (see tests/shortest_way.py). A run without a plan counts as infinitely long. In brackets:
the 95 % interval of the median; from how many seeds on RidesSST is shorter than Rides with `--improve`, out of those in
which they differ, and the p of a sign test. The constants of RidesSST were chosen on CarPark and PlanarQuadrotor with
seeds 0 to 15. Every plan was executed in a fresh environment.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binom, binomtest

from pbcs_ompl.bridge.plan import PlanResult, plan
from pbcs_ompl.envs.maze.maze import MazeEnv

sys.path.insert(0, str(Path(__file__).parents[1]))
from shortest_way import least_steps

TIMES = (1, 2, 5, 10)
MAZES = {"5x5": 5, "9x9": 9, "15x15": 15}
ENVIRONMENTS = {"MountainCar": "MountainCarContinuous-v0", "CarPark": "pbcs/CarPark-v0",
                "Quadrotor": "pbcs/PlanarQuadrotor-v0"}
CONTINUING = ("SSTCompiled", "RidesSST")


def lengths(found: PlanResult, budgets: list[int]) -> list[float]:
    """Return how long the plan was at each budget of transitions, those of the search included."""
    assert found.solved or not found.found
    if found.path_length is None:
        return [np.inf] * len(budgets)
    times, steps = [found.transitions], [float(found.path_length)]
    if found.improvement is not None:
        progress = found.improvement.progress
        times = [found.transitions + made for made in progress["transitions"]]
        steps = [float(length) for length in progress["length"]]
    return [min((length for when, length in zip(times, steps, strict=True) if when <= budget), default=np.inf)
            for budget in budgets]


def measured(name: str, seed: int, improved: list[str]) -> dict[str, list[float]]:
    """Return the lengths of all planners at all budgets.

    Args:
        name: Of the table.
        seed: Of the maze too.
        improved: Planners whose plans are made shorter afterwards.
    """
    size = MAZES.get(name)
    env, least = ENVIRONMENTS.get(name, "pbcs/Maze-v0"), least_steps(MazeEnv(size, seed)) if size else 1
    options: dict[str, Any] = {"seed": seed, "env_kwargs": {"size": size, "maze_seed": seed} if size else {}}
    unit = plan(env, "Rides", **options).transitions
    budgets = [times * unit for times in TIMES]
    found: dict[str, Any] = {f"{planner} --improve": plan(env, planner, improve=budgets[-1] - unit, **options)
                             for planner in improved}
    found |= {planner: plan(env, planner, max_transitions=budgets[-1], **options) for planner in CONTINUING}
    return {row: [length / least for length in lengths(one, budgets)] for row, one in found.items()}


def interval(values: np.ndarray) -> str:
    """Return the median and its 95 % interval from order statistics."""
    ordered, count = np.sort(values), len(values)
    low = int(binom.ppf(0.025, count, 0.5))
    middle = ordered[(count - 1) // 2:count // 2 + 1].mean()
    return f"{middle:.2f} [{ordered[max(0, low - 1)]:.2f}, {ordered[min(count - 1, count - low)]:.2f}]"


def main() -> None:
    """Read the options, and print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("tables", nargs="*", default=[*MAZES, *ENVIRONMENTS])
    parser.add_argument("--first-seed", type=int, default=8000)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--improved", nargs="*", default=["Rides"], help="planners whose plans are made shorter")
    arguments = parser.parse_args()
    for table in arguments.tables:
        runs = [measured(table, seed, arguments.improved)
                for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)]
        print(f"{table}, {len(runs)} seeds from {arguments.first_seed}\n{'':<18}"
              + "".join(f"{f'{times} x':<26}" for times in TIMES), flush=True)
        rows = {row: np.array([run[row] for run in runs]) for row in runs[0]}
        for row, values in rows.items():
            print(f"{row:<18}" + "".join(f"{interval(column):<26}" for column in values.T), flush=True)
        if "Rides --improve" not in rows:
            continue
        words = []
        for ours, theirs in zip(rows["RidesSST"].T, rows["Rides --improve"].T, strict=True):
            shorter, differ = int((ours < theirs).sum()), int((ours != theirs).sum())
            p = binomtest(shorter, differ).pvalue if differ else 1.0
            words.append(f"{f'{shorter}/{differ}, p = {p:.1g}':<26}")
        print(f"{'RidesSST shorter':<18}" + "".join(words), flush=True)


if __name__ == "__main__":
    main()
