"""How many transitions does Rides need to the first solution, beside Ex, RRT-NH and OMPL's KPIECE1?

    python tests/benchmarks/rides_transitions.py [mazes] [environments] [--first-seed 5000] [--seeds 20]

1. Mazes: five runs in each maze and their median, then the median over the mazes, and a sign test over the mazes.
   KPIECE1 is OMPL's in C++, controls held for 1 to 10 steps (see native_ompl/bench.py).
2. Environments: one run for each seed, in all environments through `plan`, median and sign test over the seeds. A run
   that is not solved within the budget counts as the worst.

Seeds 1000 to 1019, 2000 to 2019 and 3000 to 3019 are those that Rides was made and first checked on.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.resettable import make

sys.path.insert(0, str(Path(__file__).parent / "native_ompl"))
from bench import Native, built, export, search, sign_test

MAZES = {"Rides": ("Rides", {}), "Ex": ("Ex", {}), "Ex, 1 to 10 steps": ("Ex", {"control_duration": 10})}
PLANNERS = {**MAZES, "RRT-NH": ("RRTNH", {}), "RRT-NH, 1 to 10 steps": ("RRTNH", {"control_duration": 10})}
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "MountainCarContinuous-v0": {}, "PointMaze_UMaze-v3": {},
    "pbcs/Box-v0, goal (4.8, 4.8)": {"env_kwargs": {"goal": (4.8, 4.8)}},
    "pbcs/Disc-v0, goal (2.5, 2.6)": {"env_kwargs": {"goal": (2.5, 2.6)}},
    "Pendulum-v1, goal reward > -0.01": {"goal": "reward>-0.01"}}
RUNS = 5


def described(own: list[float], others: list[float]) -> str:
    """Return a median, and in how many pairs the first planner needs less."""
    solved = sum(number < inf for number in others)
    text = f"{median(others):,.0f}" + ("" if solved == len(others) else f" ({solved}/{len(others)} solved)")
    if own is others:
        return text
    pairs = list(zip(own, others, strict=True))
    fewer, more = sum(mine < theirs for mine, theirs in pairs), sum(mine > theirs for mine, theirs in pairs)
    return f"{text} ({fewer}/{len(own)}, p = {sign_test(fewer, more):.1g})"


def in_mazes(size: int, seeds: range, native: Native, folder: Path) -> dict[str, list[float]]:
    """Return the median transitions of each planner in each maze."""
    counts: dict[str, list[float]] = {}
    for seed in seeds:
        model, path = make("pbcs/Maze-v0", {"size": size, "maze_seed": seed}), folder / f"{size}-{seed}"
        export(model, path)

        def of(run: Callable[[int], Any], seed: int = seed) -> float:
            outcomes = [run(1000 * seed + k) for k in range(RUNS)]
            return median(float(outcome.transitions) if outcome.solved else inf for outcome in outcomes)

        for label, (name, options) in MAZES.items():
            counts.setdefault(label, []).append(of(lambda s, m=model, n=name, o=options: search(m, n, o, s)))
        for label, bins in (("KPIECE1 (C++), 1 to 10 steps", 1), ("the same, cells twice as large", 2)):
            counts.setdefault(label, []).append(
                of(lambda s, p=path, b=bins: native.search(p, "KPIECE1", 10, b * 0.15, s)))
    return counts


def print_rows(names: list[str], columns: list[dict[str, list[float]]], first: str) -> None:
    """Print a table in Markdown with a row for each planner."""
    print("| | " + " | ".join(names) + " |\n" + "|---" * (1 + len(names)) + "|")
    for label in columns[0]:
        cells = " | ".join(described(column[first], column[label]) for column in columns)
        print(f"| {label} | {cells} |", flush=True)


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description="Transitions of Rides to the first solution.")
    parser.add_argument("parts", nargs="*", default=["mazes", "environments"], choices=["mazes", "environments"])
    parser.add_argument("--first-seed", type=int, default=5000)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--sizes", type=int, nargs="+", default=[5, 9, 15, 25])
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    if "mazes" in given.parts:
        with tempfile.TemporaryDirectory() as name:
            native = Native(built(Path(name)), 20.0)
            columns = [in_mazes(size, seeds, native, Path(name)) for size in given.sizes]
            native.close()
        print_rows([f"{size}x{size}" for size in given.sizes], columns, "Rides")
    if "environments" in given.parts:
        for name, options in ENVIRONMENTS.items():
            column: dict[str, list[float]] = {}
            for label, (planner, kwargs) in PLANNERS.items():
                results = [plan(name.split(",")[0], planner, planner_kwargs=kwargs, seed=seed, **options)
                           for seed in seeds]
                column[label] = [float(result.transitions) if result.solved else inf for result in results]
            print_rows([name], [column], "Rides")


if __name__ == "__main__":
    main()
