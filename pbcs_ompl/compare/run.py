"""One run of a comparison, in a process of its own."""

import os
import resource
import signal
import threading
from multiprocessing import parent_process
from typing import Any, NamedTuple

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.compare.statistics import Record
from pbcs_ompl.core.errors import PbcsError

WARM_UP_TRANSITIONS = 64
WARM_UP_SECONDS = 1.0
_warm: set[tuple[str, str, str]] = set()


class Job(NamedTuple):
    """What one run is made of."""

    planner: str
    seed: int
    env: str
    env_kwargs: dict[str, Any]
    planner_kwargs: dict[str, Any]
    max_transitions: int
    max_seconds: float | None


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent process, and end when it is gone, however it went."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def run(job: Job) -> Record:
    """Plan once and return the record of it.

    All of OMPL is built anew for every run, so a worker that has made other runs gives the result of a fresh
    process. Its first run of a planner on an environment is preceded by a tiny plan, so that the
    seconds are those of the search and not of a compiler.
    """
    try:
        _warm_up(job)
        result = plan(job.env, job.planner, env_kwargs=job.env_kwargs, planner_kwargs=job.planner_kwargs,
                      seed=job.seed, max_transitions=job.max_transitions, max_seconds=job.max_seconds)
    except PbcsError as error:
        return broken(job, str(error))
    reason = None if result.solved else "the budget ended before the goal was reached"
    return {"planner": job.planner, "seed": job.seed, "solved": result.solved,
            "transitions": result.transitions, "seconds": result.seconds, "nodes": result.nodes,
            "path_length": result.path_length, "replay_ok": result.replay_ok, "memory": _peak_megabytes(),
            "reason": reason}


def broken(job: Job, reason: str) -> Record:
    """Return the record of a run that did not come to an end."""
    return {"planner": job.planner, "seed": job.seed, "solved": False, "transitions": None, "seconds": None,
            "nodes": None, "path_length": None, "replay_ok": None, "memory": None,
            "reason": " ".join(reason.split())}


def _warm_up(job: Job) -> None:
    key = (job.planner, job.env, repr(job.env_kwargs))
    if key not in _warm:
        plan(job.env, job.planner, env_kwargs=job.env_kwargs, planner_kwargs=job.planner_kwargs,
             max_transitions=min(WARM_UP_TRANSITIONS, job.max_transitions), max_seconds=WARM_UP_SECONDS)
        _warm.add(key)


def _peak_megabytes() -> float:
    """Return the most memory this process has had so far, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _follow_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
