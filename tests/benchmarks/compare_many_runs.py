"""10 000 recorded runs: how long it takes to list, read, merge and report them, and how much memory.

    python tests/benchmarks/compare_many_runs.py
"""

import json
import random
import re
import tempfile
import time
from pathlib import Path

from pbcs_ompl.bridge.coverage import log_spaced
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.experiments.compare import read_comparison
from pbcs_ompl.experiments.planner_arena import write_database, write_logs
from pbcs_ompl.experiments.planning_run import failed_record
from pbcs_ompl.experiments.records import record_file
from pbcs_ompl.experiments.run import Failure, Record, Run
from pbcs_ompl.experiments.sweep import Sweep, make_sweep
from pbcs_ompl.results.files import CONFIG, write_toml
from pbcs_ompl.results.report import write_report

PLANNERS, SIZES, SEEDS = ("Ex", "RRTNH", "EST", "KPIECE1"), range(2, 12), 250
LIMIT_SECONDS, LIMIT_MEGABYTES = 20.0, 500.0


def record(run: Run, rng: random.Random) -> Record:
    """Return what a run could have recorded, with a curve of some 55 points; one run in ten is not solved."""
    transitions = rng.randint(10_000, 1_000_000)
    points = log_spaced(transitions).tolist()
    return {**failed_record(run, Failure("made up")), "solved": rng.random() < 0.9, "transitions": transitions,
            "seconds": rng.random(), "collision_checks": transitions + 1, "nodes": transitions, "path_length": 300,
            "replay_ok": True,
            "memory": 250.0, "coverage": rng.random(),
            "progress": {"transitions": points, "seconds": sorted(rng.random() for _ in points),
                         "coverage": sorted(rng.random() for _ in points)}}


def write_records(folder: Path, sweep: Sweep) -> int:
    """Write a record for every run of the sweep; return how many."""
    rng, runs = random.Random(0), list(sweep.runs())
    for run in runs:
        file = record_file(folder, run.name)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(record(run, rng), indent=2))
    write_toml(folder / CONFIG, sweep.config())
    return len(runs)


def peak_megabytes() -> float:
    return int(re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())[1]) * 1024 / 1e6


def main() -> None:
    """Write the records, merge them, print what it took."""
    environments = [EnvSpec("pbcs/Maze-v0", {"size": size}) for size in SIZES]
    sweep = make_sweep(PLANNERS, environments, SEEDS, 1_000_000, None, None)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count = write_records(folder, sweep)
        began = time.perf_counter()
        found = read_comparison(folder)
        merged = time.perf_counter()
        write_database(folder / "comparison.db", write_logs(folder, sweep, found.runs))
        written = time.perf_counter()
        del found  # pbcs report is a process of its own
        page = write_report(folder).page
        ended, size = time.perf_counter(), page.stat().st_size / 1e6
    seconds, megabytes = ended - began, peak_megabytes()
    print(f"{count} records: listed, read and merged in {merged - began:.1f} s, logs and database in "
          f"{written - merged:.1f} s, the report of {size:.1f} MB in {ended - written:.1f} s; together "
          f"{seconds:.1f} s, peak of the process {megabytes:.0f} MB")
    verdict = "reached" if seconds < LIMIT_SECONDS and megabytes < LIMIT_MEGABYTES else "MISSED"
    print(f"{verdict}: under {LIMIT_SECONDS:.0f} s and {LIMIT_MEGABYTES:.0f} MB")


if __name__ == "__main__":
    main()
