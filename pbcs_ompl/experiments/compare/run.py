"""One run of a comparison, in a process that may have made others."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.bridge.coverage import Coverage
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import PbcsError

Record = dict[str, Any]
"""What is kept of a run; see docs/compare.md."""
MEASURED = ("transitions", "collision_checks", "seconds", "nodes", "path_length", "replay_ok", "memory", "coverage",
            "progress")
"""What a record has beside its job; None in a run that did not come to an end."""
WARM_UP_TRANSITIONS = 64
WARM_UP_SECONDS = 1.0
_warm: set[tuple[str, str]] = set()


class Job(NamedTuple):
    """What one run is made of."""

    name: str
    """Its name in the comparison, and the path of its record without the ending."""
    planner: str
    seed: int
    environment: EnvSpec
    planner_kwargs: dict[str, Any]
    max_transitions: int
    max_seconds: float | None


def run(job: Job) -> Record:
    """Plan once and return the record of it.

    All of OMPL is built anew for every run, so a worker that has made other runs gives the result of a fresh
    process. Its first run of a planner on an environment is preceded by a tiny plan, so that the
    seconds are those of the search and not of a compiler.
    """
    try:
        _warm_up(job)
        _forget_peak_of_memory()
        result = plan(job.environment, job.planner, planner_kwargs=job.planner_kwargs,
                      seed=job.seed, max_transitions=job.max_transitions, max_seconds=job.max_seconds, coverage=True)
    except PbcsError as error:
        return broken(job, str(error))
    reason = None if result.solved else "the budget ended before the goal was reached"
    measured = {name: value for name, value in result.summary().items() if name in MEASURED}
    return {**_identity(job), "solved": result.solved, **measured, "memory": _peak_megabytes(),
            **_coverage(result.coverage), "reason": reason}


def broken(job: Job, reason: str) -> Record:
    """Return the record of a run that did not come to an end."""
    return {**_identity(job), "solved": False, **dict.fromkeys(MEASURED), "reason": " ".join(reason.split())}


def folder_of(record: Record) -> str:
    """Return the folder of a record, which stands for its environment."""
    return str(record["name"]).partition("/")[0]


def _identity(job: Job) -> Record:
    return {"name": job.name, "planner": job.planner, "seed": job.seed,
            "environment": job.environment.to_dict()}


def _coverage(coverage: Coverage | None) -> Record:
    """Return the last share, and the curve that led there."""
    if coverage is None or not len(coverage.share):
        return {"coverage": None, "progress": None}
    return {"coverage": float(coverage.share[-1]),
            "progress": {"transitions": coverage.transitions.tolist(), "seconds": coverage.seconds.tolist(),
                         "coverage": coverage.share.tolist()}}


def _warm_up(job: Job) -> None:
    key = (job.planner, job.environment.label)
    if key not in _warm:
        plan(job.environment, job.planner, planner_kwargs=job.planner_kwargs, coverage=True,
             max_transitions=min(WARM_UP_TRANSITIONS, job.max_transitions), max_seconds=WARM_UP_SECONDS)
        _warm.add(key)


def _forget_peak_of_memory() -> None:
    """Have Linux take the peak of this process's memory from now on."""
    with suppress(OSError):  # another system
        Path("/proc/self/clear_refs").write_text("5")


def _peak_megabytes() -> float | None:
    """Return the most memory this process has had, in MB of 10^6 bytes; None where the system is not Linux."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return None
    peak = re.search(r"VmHWM:\s*(\d+) kB", status)
    return None if peak is None else int(peak[1]) * 1024 / 1e6
