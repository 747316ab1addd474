"""What `plan` costs beside the search, part by part, in CPU time of one thread.

    python tests/benchmarks/plan_overhead.py [PLANS]

A plan makes its environment, searches, takes the path as a trajectory, and executes it in a fresh environment by
`reset` and `step`. The search's own time is that of the planner's `solve`, which ends with OMPL's path. The bar holds
where a search takes 5 ms or more. Mazes, planners and seeds alternate.
"""

import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

from pbcs_ompl.bridge import plan as module
from pbcs_ompl.planners.planner import TreePlanner

PLANS = 20
ENV = "pbcs/Maze-v0"
SIZES, PLANNERS = (5, 9, 15, 25), ("Ex", "Rides")
LEAST_SECONDS, MOST_RATIO = 0.005, 1.5
PARTS = {"make": "environment", "make_problem": "OMPL's problem", "_solution": "trajectory", "verify": "judge"}

Spent = dict[str, float]


def timed(spent: Spent, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return `function`, whose CPU seconds are added to a part."""
    def call(*args: Any, **kwargs: Any) -> Any:
        began = time.thread_time()
        try:
            return function(*args, **kwargs)
        finally:
            spent[part] += time.thread_time() - began

    return call


def measure(spent: Spent, planner: str, size: int, seed: int) -> None:
    """Make one plan, and add what its parts took."""
    with patch.object(TreePlanner, "solve", timed(spent, "search", TreePlanner.solve)):
        patches = [patch.object(module, name, timed(spent, part, getattr(module, name)))
                   for name, part in PARTS.items()]
        for one in patches:
            one.start()
        try:
            timed(spent, "all", module.plan)(ENV, planner, env_kwargs={"size": size, "maze_seed": 1}, seed=seed)
        finally:
            for one in patches:
                one.stop()


def main(plans: int = PLANS) -> None:
    """Measure, print, and say whether the bar is reached."""
    settings = [(planner, size) for size in SIZES for planner in PLANNERS]
    spent: dict[tuple[str, int], Spent] = {setting: defaultdict(float) for setting in settings}
    for planner, size in settings:
        measure(defaultdict(float), planner, size, plans)  # compiles
    for seed in range(plans):
        for planner, size in settings:
            measure(spent[planner, size], planner, size, seed)
    names = ["search", *PARTS.values()]
    print(f"milliseconds of CPU time, mean of {plans} plans\n"
          f"{'':<14}" + "".join(f"{name:>16}" for name in [*names, "rest", "all", "all / search"]))
    missed = []
    for (planner, size), parts in spent.items():
        rest = parts["all"] - sum(parts[name] for name in names)
        numbers = [*(parts[name] for name in names), rest, parts["all"]]
        ratio = parts["all"] / parts["search"]
        print(f"{planner:<6}{size:>3}x{size:<4}" + "".join(f"{1e3 * number / plans:>16.2f}" for number in numbers)
              + f"{ratio:>16.2f}")
        if parts["search"] / plans >= LEAST_SECONDS and ratio > MOST_RATIO:
            missed.append(f"{planner} {size}x{size}")
    print(f"{'MISSED by ' + ', '.join(missed) if missed else 'reached'}: at most {MOST_RATIO} times the search's own "
          f"time where that is at least {1e3 * LEAST_SECONDS:g} ms")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
