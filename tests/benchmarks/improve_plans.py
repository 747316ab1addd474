"""How long are plans beside the shortest ones, before and after `--improve`?

    python tests/benchmarks/improve_plans.py [mazes] [environments] [--first-seed 7000] [--seeds 40]

1. Mazes: the length of each plan over the least number of steps (see tests/shortest_way.py), with 10, 50 and 100 % more
   transitions than the search. Median over the mazes with a 95 % interval, how many are at most 1.5 times too long, and
   what the improvement takes beside the search.
2. Environments without a known shortest plan: median steps before and after.

Every plan is executed in a fresh environment, and only these are counted. The constants of
`bridge/improvement/improve.py` were chosen on mazes 100 to 107 of 9x9 and 15x15.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binom

from pbcs_ompl.bridge.plan import PlanResult, plan
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.envs.maze.maze import MazeEnv

sys.path.insert(0, str(Path(__file__).parents[1]))
from shortest_way import least_steps

SIZES, PLANNERS, SHARES = (5, 9, 15), ("Ex", "Rides"), ("10%", "50%", "100%")
MOST = 1.5
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "MountainCarContinuous-v0": {}, "PointMaze_UMaze-v3": {},
    "pbcs/Disc-v0, goal (2.5, 2.6)": {"env_kwargs": {"goal": (2.5, 2.6)}},
    "pbcs/Box-v0, goal (4.8, 4.8)": {"env_kwargs": {"goal": (4.8, 4.8)}}}


def interval(values: np.ndarray) -> str:
    """Return the median and its 95 % interval from order statistics."""
    ordered, count = np.sort(values), len(values)
    low = int(binom.ppf(0.025, count, 0.5))
    return f"{np.median(values):.2f} [{ordered[max(0, low - 1)]:.2f}, {ordered[min(count - 1, count - low)]:.2f}]"


def improved(env: str, planner: str, seed: int, share: str, options: dict[str, Any]) -> PlanResult:
    """Return an improved plan that was executed."""
    result = plan(env, planner, seed=seed, improve=share, **options)
    assert result.solved
    assert result.improvement is not None
    assert result.path_length == result.improvement.after
    return result


def mazes(first: int, count: int) -> None:
    """Print the table of mazes."""
    print(f"length over the least number of steps, {count} mazes from seed {first}: median [95 % interval]\n"
          f"{'':<12}{'more':<7}{'before':<22}{'after':<22}{f'at most {MOST}':<24}{'seconds / search':<10}")
    for size in SIZES:
        least = np.array([least_steps(MazeEnv(size, maze_seed)) for maze_seed in range(first, first + count)])
        for planner in PLANNERS:
            for share in SHARES:
                found = [improved("pbcs/Maze-v0", planner, seed, share,
                                  {"env_kwargs": {"size": size, "maze_seed": first + seed}}) for seed in range(count)]
                steps = [one.improvement for one in found if one.improvement is not None]
                before = np.array([one.before for one in steps]) / least
                after = np.array([one.after for one in steps]) / least
                good = int((after <= MOST).sum())
                low, high = wilson(good, count)
                cost = float(np.median([one.improvement.seconds / one.seconds for one in found if one.improvement]))
                print(f"{size:>2}x{size:<3}{planner:<6}{share:<7}{interval(before):<22}{interval(after):<22}"
                      f"{f'{good}/{count} [{low:.2f}, {high:.2f}]':<24}{cost:.1f}", flush=True)


def environments(first: int, count: int) -> None:
    """Print the table of other environments."""
    print(f"steps, {count} seeds from {first}: median [95 % interval]\n"
          f"{'':<36}{'more':<7}{'before':<28}{'after':<28}")
    for name, options in ENVIRONMENTS.items():
        for planner in PLANNERS:
            for share in SHARES:
                found = [improved(name.partition(",")[0], planner, first + seed, share, options).improvement
                         for seed in range(count)]
                before, after = (np.array([getattr(one, when) for one in found]) for when in ("before", "after"))
                print(f"{name:<30}{planner:<6}{share:<7}{interval(before):<28}{interval(after):<28}", flush=True)


def main() -> None:
    """Read the options, and print the tables that are asked for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("tables", nargs="*", default=["mazes", "environments"])
    parser.add_argument("--first-seed", type=int, default=7000)
    parser.add_argument("--seeds", type=int, default=40)
    arguments = parser.parse_args()
    for table in arguments.tables:
        {"mazes": mazes, "environments": environments}[table](arguments.first_seed, arguments.seeds)


if __name__ == "__main__":
    main()
