"""What executes runs, and the one that uses processes of this machine."""

from collections import deque
from collections.abc import Generator, Sequence
from functools import partial
from multiprocessing.connection import wait
from typing import Protocol

from pbcs_ompl.core.options import check_range
from pbcs_ompl.experiments.run import Failure, Record, Run, RunFunction
from pbcs_ompl.experiments.workers.start import check_script
from pbcs_ompl.experiments.workers.worker import Limits, Worker

MOST_JOBS = 1024


class Executor(Protocol):
    """What executes runs: processes of this machine, or a cluster (see `ray_cluster`)."""

    def __call__(self, runs: Sequence[Run], function: RunFunction,
                 limits: Limits) -> Generator[tuple[Run, Record | Failure], None, None]:
        """Yield each run once, when it ends, with what it found.

        Close the generator (`contextlib.closing`) if you may leave it before its end: that ends the runs.

        Args:
            runs: The runs.
            function: Makes one of them, in another process.
            limits: What each of them may use.
        """
        ...


def make_executor(jobs: int | Executor) -> Executor:
    """Return what executes runs.

    Args:
        jobs: How many processes of this machine work at a time, or what executes the runs elsewhere.

    Raises:
        InvalidOption: fewer than one process.
        CannotStart: they could not import the running script.
    """
    if not isinstance(jobs, int):
        check_range("jobs", jobs, callable(jobs), "an integer, or what executes runs, such as ray_cluster(...)")
        return jobs
    check_range("jobs", jobs, not isinstance(jobs, bool) and 1 <= jobs <= MOST_JOBS, f"from 1 to {MOST_JOBS}")
    check_script()
    return partial(run_in_processes, jobs)


def run_in_processes(jobs: int, runs: Sequence[Run], function: RunFunction,
                     limits: Limits) -> Generator[tuple[Run, Record | Failure], None, None]:
    """Execute runs in `jobs` processes; one that dies, hangs or exceeds a limit fails its own run only."""
    waiting = deque(runs)
    workers = [Worker(function, limits) for _ in range(min(jobs, len(waiting)))]
    try:
        for worker in workers:
            worker.start(waiting.popleft())
        while workers:
            yield from _completed(workers, waiting)
    finally:
        for worker in workers:
            worker.kill()


def _completed(workers: list[Worker], waiting: deque[Run]) -> Generator[tuple[Run, Record | Failure], None, None]:
    """Wait until something happens; yield the runs that ended, after their workers have started others."""
    timeouts = [seconds for worker in workers if (seconds := worker.seconds_to_wait()) is not None]
    wait([worker.connection for worker in workers], min(timeouts, default=None))
    for worker in list(workers):
        run, found = worker.run, worker.poll()
        if found is None:
            continue
        continues = bool(waiting)
        if continues:
            worker.start(waiting.popleft())
        yield run, found
        if not continues:
            workers.remove(worker)
            worker.shutdown()
