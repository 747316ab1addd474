"""Runs in processes of this machine; one that dies, hangs or eats memory costs its own run only."""

from collections import deque
from collections.abc import Callable, Generator, Sequence
from multiprocessing.connection import wait
from typing import TypeVar

from pbcs_ompl.experiments.workers.worker import Worker

Job = TypeVar("Job")
Record = TypeVar("Record")


def run_all(jobs: Sequence[Job], workers: int, run: Callable[[Job], Record], broken: Callable[[Job, str], Record], *,
            max_seconds: float | None = None, max_memory: float | None = None) -> Generator[Record, None, None]:
    """Run jobs in spawned processes, which are reused from run to run; see `executors.run_all`."""
    waiting = deque(jobs)
    crew = [Worker(run, max_seconds, max_memory) for _ in range(min(workers, len(waiting)))]
    try:
        for worker in crew:
            worker.begin(waiting.popleft())
        while crew:
            yield from _news(crew, waiting, broken)
    finally:
        for worker in crew:
            worker.kill()


def _news(crew: list[Worker], waiting: deque[Job],
          broken: Callable[[Job, str], Record]) -> Generator[Record, None, None]:
    """Wait until something happens; yield the records of the runs that ended, after their workers began others."""
    patience = [seconds for worker in crew if (seconds := worker.seconds_to_wait()) is not None]
    wait([worker.connection for worker in crew], min(patience, default=None))
    for worker in list(crew):
        job, ended = worker.job, worker.look()
        if ended is None:
            continue
        goes_on = bool(waiting)
        if goes_on:
            worker.begin(waiting.popleft())
        yield ended.record if ended.reason is None else broken(job, ended.reason)
        if not goes_on:
            crew.remove(worker)
            worker.dismiss()
