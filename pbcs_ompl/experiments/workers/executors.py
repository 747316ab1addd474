"""The one call that executes runs, wherever that is."""

from collections.abc import Callable, Generator, Sequence
from typing import Any, Protocol, TypeVar

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.workers import local

Job = TypeVar("Job")
Record = TypeVar("Record")


class Executor(Protocol):
    """What executes runs elsewhere, such as `ray_cluster`."""

    def __call__(self, jobs: Sequence[Any], run: Callable[[Any], Any], broken: Callable[[Any, str], Any], *,
                 max_seconds: float | None, max_memory: float | None) -> Generator[Any, None, None]:
        """Yield one record for each job, as `run_all` does."""


def run_all(jobs: Sequence[Job], workers: int | Executor, run: Callable[[Job], Record],
            broken: Callable[[Job, str], Record], *, max_seconds: float | None = None,
            max_memory: float | None = None) -> Generator[Record, None, None]:
    """Execute jobs and yield their records as they come, one for each job.

    Close the generator (`contextlib.closing`) when you may leave it before its end: that ends the runs.

    Args:
        workers: How many processes of this machine work at a time, or what executes the runs elsewhere.
        run: Makes a record of a job; other processes must be able to import it.
        broken: Makes a record of a job that did not come to an end, and of the reason.
        max_seconds: Wall time of one run, without the start of its process; enforced from outside.
        max_memory: Resident memory of the process of one run, in MB of 10^6 bytes; enforced from outside.
    """
    if isinstance(workers, int):
        return local.run_all(jobs, workers, run, broken, max_seconds=max_seconds, max_memory=max_memory)
    return workers(jobs, run, broken, max_seconds=max_seconds, max_memory=max_memory)


def check_resources(workers: int | Executor, max_seconds: float | None = None, max_memory: float | None = None) -> None:
    """Refuse fewer than one process, and limits that nothing can keep.

    Raises:
        InvalidOption: one of them is out of its range.
    """
    if isinstance(workers, int) and workers < 1:
        raise InvalidOption(f"jobs is {workers}; expected at least 1")
    for name, limit in (("max_seconds", max_seconds), ("max_memory", max_memory)):
        if limit is not None and not limit > 0:
            raise InvalidOption(f"{name} is {limit}; expected more than 0")
