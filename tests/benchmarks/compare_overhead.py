"""What the runner of comparisons costs: its overhead over the runs' own time, and what a second worker brings.

    python tests/benchmarks/compare_overhead.py [RUNS]

The runs last at least 0.5 s each: EST in a large maze, stopped by its budget. Their own time is that of the same calls
of `plan`, one after the other in this process. The rest of a comparison's wall time is overhead: coverage, records,
messages to the parent, the database; and once the start of the process, its imports and compilers, shown apart. So is
the time beside the search alone, most of which `plan` takes to read the tree out of OMPL. All this needs two cores
that nothing else uses; the overhead in CPU time, of all processes, less what a comparison of one run takes, does not.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.experiments.compare import compare

RUNS = 20
ENV, MAZE, PLANNER, TRANSITIONS = "pbcs/Maze-v0", {"size": 15, "maze_seed": 1}, "EST", 50_000
LEAST_SECONDS, MOST_OVERHEAD, LEAST_GAIN = 0.5, 0.10, 1.8


class Timing(NamedTuple):
    """Wall seconds of a comparison, and CPU seconds of all its processes."""

    whole: float
    """All of it."""
    after_first: float
    """From the end of the first run on."""
    searches: list[float]
    """What the searches took, the first one's first."""
    cpu: float


def measure(runs: int, jobs: int) -> Timing:
    """Compare one planner with `runs` seeds, as a user does, and look at the clock."""
    ends: list[float] = []

    def look(numbers: dict[str, Any]) -> None:
        if numbers["runs"]:
            ends.append(time.perf_counter())

    with tempfile.TemporaryDirectory() as folder:
        began, before = time.perf_counter(), cpu_seconds()
        found = compare([PLANNER], ENV, env_kwargs=MAZE, seeds=runs, max_transitions=TRANSITIONS, jobs=jobs,
                        out=Path(folder) / "out", on_progress=look)
        ended = time.perf_counter()
    return Timing(ended - began, ended - ends[0], [record["seconds"] for record in found.runs], cpu_seconds() - before)


def cpu_seconds() -> float:
    """Return the CPU time of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def plain(runs: int) -> tuple[float, float]:
    """Return the wall and the CPU seconds of the same runs, but the first, in a loop."""
    plan(ENV, PLANNER, env_kwargs=MAZE, seed=0, max_transitions=TRANSITIONS)
    began, before = time.perf_counter(), cpu_seconds()
    for seed in range(1, runs):
        plan(ENV, PLANNER, env_kwargs=MAZE, seed=seed, max_transitions=TRANSITIONS)
    return time.perf_counter() - began, cpu_seconds() - before


def main(runs: int = RUNS) -> None:
    """Measure, print, and say whether the bars are reached."""
    (own, own_cpu), start, one, two = plain(runs), measure(1, 1), measure(runs, 1), measure(2 * runs, 2)
    overhead, overhead_cpu = one.after_first / own - 1, (one.cpu - start.cpu) / own_cpu - 1
    print(f"one worker: {runs} runs with searches of {min(one.searches):.2f} to {max(one.searches):.2f} s; "
          f"overhead {overhead:.1%} of the runs' own time, {overhead_cpu:.1%} in CPU time")
    print(f"            over the searches alone {one.after_first / sum(one.searches[1:]) - 1:.1%}, "
          f"with the start of the process {one.whole / sum(one.searches) - 1:.1%}")
    gain = (2 * runs - 2) / two.after_first / ((runs - 1) / one.after_first)
    print(f"two workers: {gain:.2f} times the throughput of one, "
          f"{2 * one.whole / two.whole:.2f} times with the start of the processes")
    ok = overhead < MOST_OVERHEAD and gain >= LEAST_GAIN and min(one.searches) >= LEAST_SECONDS
    print(f"{'reached' if ok else 'MISSED'}: overhead under {MOST_OVERHEAD:.0%} for runs of at least "
          f"{LEAST_SECONDS} s, two workers at least {LEAST_GAIN} times one")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
