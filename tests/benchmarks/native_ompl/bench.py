"""How fast are our planners beside OMPL's own in C++? One table for each size of maze, made in one run.

    apt-get install libompl-dev libeigen3-dev g++      # Debian, Ubuntu; or OMPL from source
    python tests/benchmarks/native_ompl/bench.py [--sizes 9 15] [--mazes 40] [--first-seed 4000]

All planners have the same walls, steps, start, goal and cells (the bins of Ex and Rides; KPIECE1 and Rides also have
rows with cells twice as large, which both like). None knows where the goal is, but OMPL's KPIECE1 knows how far it is,
unless it is called blind. OMPL's are compiled from `planners.cpp` with -O3 -march=native; ours run through
`pbcs_ompl`, their loops compiled before. Seconds are CPU seconds of the search alone. For each maze the planners run
one after the other, so that other work on the machine slows all of them. The numbers in brackets are the mazes in which
Rides needs less, with the p of a two-sided sign test. Below the table stand the same numbers for Rides and KPIECE1 in
the larger cells, and whether those of ours that repeat one of OMPL's need as many transitions.
"""

import argparse
import math
import subprocess
import tempfile
import time
from pathlib import Path
from shutil import which
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from ompl import base as ob

from pbcs_ompl import planners
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.types import Counter
from pbcs_ompl.envs.point_kernels import GOAL_RADIUS, GOAL_X, GOAL_Y
from pbcs_ompl.resettable import make

HERE = Path(__file__).parent
HELD = {"control_duration": 10}
OURS = (("Rides", {}, 1), ("Rides", {}, 2), ("Ex", {}, 1), ("Ex", HELD, 1), ("KPIECE1Compiled", HELD, 1),
        ("ESTCompiled", HELD, 1), ("RRTCompiled", HELD, 1))
"""Name, options, and edge of the cells in bins."""
NATIVE = (("KPIECE1", 1, 1), ("KPIECE1", 10, 1), ("KPIECE1", 10, 2), ("blind KPIECE1", 10, 1), ("EST", 1, 1),
          ("EST", 10, 1), ("PDST", 1, 1), ("PDST", 10, 1), ("RRT", 1, 1), ("RRT", 10, 1), ("SST", 1, 1), ("SST", 10, 1))
"""Name, most steps of a control, and edge of the cells in bins."""
SAME = (("KPIECE1Compiled", "blind KPIECE1"), ("ESTCompiled", "EST"), ("RRTCompiled", "RRT"))
"""Strategies of ours that repeat one of OMPL's."""
LARGE = ", cells twice as large"
BUDGET = 5_000_000


class Outcome(NamedTuple):
    """One search: how it ended, its transitions, CPU seconds, and the steps of its path."""

    solved: bool
    transitions: int
    seconds: float
    steps: int


def built(folder: Path) -> Path:
    """Compile planners.cpp; return the program.

    Raises:
        SystemExit: something that it needs is not installed.
    """
    missing = [tool for tool in ("g++", "pkg-config") if which(tool) is None]
    if missing or subprocess.run(["pkg-config", "--exists", "ompl"], check=False).returncode:
        raise SystemExit(f"{', '.join(missing) or 'libompl-dev'} is not installed: apt-get install libompl-dev "
                         "libeigen3-dev g++ pkg-config")
    asked = subprocess.run(["pkg-config", "--cflags", "ompl"], check=True, capture_output=True, text=True)
    program = folder / "planners"
    subprocess.run(["g++", *asked.stdout.split(), "-std=c++17", "-O3", "-march=native", "-ffp-contract=off", "-DNDEBUG",
                    str(HERE / "planners.cpp"), "-o", str(program), "-lompl"], check=True)
    return program


def export(model: Any, path: Path) -> None:
    """Write the walls, start and goal of a maze for planners.cpp."""
    settings, rectangles, lists = model.compiled_step()[1:]
    cells = round(5 * model.state_high[0])
    with path.open("wb") as file:
        numbers = [model.state_high[0], *model.initial_state(), *settings[[GOAL_X, GOAL_Y, GOAL_RADIUS]]]
        np.array(numbers, np.float64).tofile(file)
        np.array([cells, len(rectangles), len(lists)], np.int64).tofile(file)
        rectangles.tofile(file)
        lists.tofile(file)


class Native:
    """OMPL's planners in C++, in a process of their own.

    Args:
        program: See `built`.
        limit: The most CPU seconds of a search.
    """

    def __init__(self, program: Path, limit: float):
        self._process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._limit = limit

    def search(self, maze: Path, name: str, most_steps: int, cell: float, seed: int, *, blind: bool = False) -> Outcome:
        """Run one planner on one maze; a blind one does not know how far the goal is."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(maze, name, most_steps, cell, seed, BUDGET, self._limit, int(blind), file=self._process.stdin, flush=True)
        solved, transitions, seconds, steps = self._process.stdout.readline().split()
        return Outcome(solved == "1", int(transitions), float(seconds), int(steps))

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def search(model: Any, name: str, options: dict[str, Any], seed: int) -> Outcome:
    """Run one of our planners on one maze."""
    counter = Counter(BUDGET)
    with quiet_ompl(), make_problem(model, counter=counter, seed=seed) as problem:
        planner = getattr(planners, name).build(problem.space_information, seed=seed, **options)
        planner.use_model(model, counter)
        problem.setup.setPlanner(planner)
        problem.setup.setup()
        began = time.thread_time()
        planner.solve(ob.PlannerTerminationCondition(lambda: False))
        seconds = time.thread_time() - began
        if planner.error is not None:
            raise planner.error
        steps = 0 if planner.solution is None else len(planner.solution) - 1
        solved = problem.setup.haveExactSolutionPath()
    return Outcome(solved, counter.count, seconds, steps)


def run_all(size: int, seeds: range, native: Native, folder: Path) -> dict[str, list[Outcome]]:
    """Return the outcomes of every planner, in the order of the seeds."""
    outcomes: dict[str, list[Outcome]] = {}
    for name, options, _ in OURS:
        search(make("pbcs/Maze-v0", {"size": 3}), name, options, 0)  # compile
    for seed in seeds:
        model, path = make("pbcs/Maze-v0", {"size": size, "maze_seed": seed}), folder / f"{size}-{seed}"
        export(model, path)
        for name, options, bins in OURS:
            label = f"{name}, ours" + (", 1 to 10 steps" if options else "") + (LARGE if bins > 1 else "")
            cells = {"bin_size": bins * float(model.bin_size[0])} if bins > 1 else {}
            outcomes.setdefault(label, []).append(search(model, name, options | cells, seed))
        for name, most_steps, bins in NATIVE:
            label = (f"{name}, C++" + (", 1 to 10 steps" if most_steps > 1 else ", 1 step")
                     + (LARGE if bins > 1 else ""))
            done = outcomes.setdefault(label, [])
            if len(done) >= 5 and not any(outcome.solved for outcome in done):
                continue  # nothing more is learnt from further time-outs
            done.append(native.search(path, name.removeprefix("blind "), most_steps, bins * float(model.bin_size[0]),
                                      seed + 1, blind=name.startswith("blind")))
    return outcomes


def sign_test(fewer: int, more: int) -> float:
    """Return the two-sided p of these numbers of pairs."""
    total, extreme = fewer + more, max(fewer, more)
    tail = sum(math.comb(total, k) for k in range(extreme, total + 1)) / 2**total
    return min(1.0, 2 * tail)


def beside(ours: list[Outcome], others: list[Outcome], field: str) -> str:
    """Return in how many runs ours needs less, a run that is not solved being the worst."""
    pairs = [tuple(getattr(run, field) if run.solved else math.inf for run in pair)
             for pair in zip(ours, others, strict=False)]
    fewer, more = (sum(sign * (theirs - own) > 0 for own, theirs in pairs) for sign in (1, -1))
    return f"({fewer}/{len(pairs)}, p = {sign_test(fewer, more):.1g})"


def table(size: int, outcomes: dict[str, list[Outcome]]) -> None:
    """Print the medians over the solved runs as a table in Markdown."""
    rides = outcomes["Rides, ours"]
    print(f"\n| {size}x{size}, {len(rides)} mazes | solved | ms | transitions | million transitions/s | path steps |")
    print("|---|---|---|---|---|---|")
    for label, runs in outcomes.items():
        solved = [run for run in runs if run.solved]
        rate = sum(run.transitions for run in runs) / sum(run.seconds for run in runs) / 1e6
        if not solved:
            print(f"| {label} | 0/{len(runs)} | | | {rate:.1f} | |")
            continue
        seconds, transitions, steps = (median(getattr(run, field) for run in solved)
                                       for field in ("seconds", "transitions", "steps"))
        signs = ["" if runs is rides else " " + beside(rides, runs, field) for field in ("seconds", "transitions")]
        print(f"| {label} | {len(solved)}/{len(runs)} | {1e3 * seconds:.2f}{signs[0]} | {transitions:,.0f}{signs[1]} "
              f"| {rate:.1f} | {steps:,.0f} |", flush=True)
    in_large = (outcomes[f"Rides, ours{LARGE}"], outcomes[f"KPIECE1, C++, 1 to 10 steps{LARGE}"])
    print(f"In cells twice as large Rides needs less time than KPIECE1 {beside(*in_large, 'seconds')}")
    for ours, theirs in SAME:
        pair = (outcomes[f"{ours}, ours, 1 to 10 steps"], outcomes[f"{theirs}, C++, 1 to 10 steps"])
        print(f"{ours} needs fewer transitions than {theirs} {beside(*pair, 'transitions')}")


def main() -> None:
    """Compile, run, and print a table for each size."""
    parser = argparse.ArgumentParser(description="Our planners beside OMPL's in C++.")
    parser.add_argument("--sizes", type=int, nargs="+", default=[9, 15])
    parser.add_argument("--mazes", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=4000)
    parser.add_argument("--limit", type=float, default=2.0, help="the most CPU seconds of a search in C++")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        native = Native(built(Path(name)), given.limit)
        for size in given.sizes:
            table(size, run_all(size, range(given.first_seed, given.first_seed + given.mazes), native, Path(name)))
        native.close()


if __name__ == "__main__":
    main()
