"""Run many jobs in spawned processes; one that dies costs its own run only."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children, get_context
from typing import TypeVar

from pbcs_ompl.compare.run import prepare_worker

Job = TypeVar("Job")
Record = TypeVar("Record")
DIED = ("the process died: a crash in C++, or out of memory (or a script without "
        "if __name__ == '__main__': around its calls)")


def run_all(jobs: Sequence[Job], workers: int, run: Callable[[Job], Record],
            broken: Callable[[Job, str], Record]) -> Iterator[Record]:
    """Run jobs in `workers` processes and yield their records as they come.

    A process that dies takes the whole pool with it. Jobs start in order, so the culprit is among the first
    `workers` unfinished ones; these are run again, each in a process of its own, before the others go on.

    Args:
        run: Makes a record of a job; other processes must be able to import it.
        broken: Makes a record of a job that did not come to an end, and of the reason.
    """
    left = list(jobs)
    while left:
        for job, record in _in_pool(left, workers, run, broken):
            left.remove(job)
            yield record
        for suspect in left[:workers]:
            left.remove(suspect)
            records = [record for _, record in _in_pool([suspect], 1, run, broken)]
            yield records[0] if records else broken(suspect, DIED)


def _in_pool(jobs: Sequence[Job], workers: int, run: Callable[[Job], Record],
             broken: Callable[[Job, str], Record]) -> Iterator[tuple[Job, Record]]:
    """Yield the jobs that end in a pool, until one of them takes the pool down."""
    bystanders = set(active_children())
    pool = ProcessPoolExecutor(min(workers, len(jobs)), get_context("spawn"), prepare_worker)
    try:
        futures: dict[Future[Record], Job] = {pool.submit(run, job): job for job in jobs}
        for future in as_completed(futures):
            error = future.exception()
            if isinstance(error, BrokenProcessPool):
                continue
            if error is not None:  # a mistake of ours or of a plug-in's author: the others go on
                yield futures[future], broken(futures[future], f"{type(error).__name__}: {error}")
            else:
                yield futures[future], future.result()
        pool.shutdown()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in set(active_children()) - bystanders:
            child.terminate()
        raise
