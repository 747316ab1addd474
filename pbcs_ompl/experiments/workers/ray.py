"""Runs on a Ray cluster, each in a worker process as on one machine; a node that is lost costs no run."""

import socket
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import ModuleType
from typing import Any, TypeVar

from pbcs_ompl.core.errors import InvalidOption, Mismatch, MissingDependency
from pbcs_ompl.experiments.workers.executors import Executor
from pbcs_ompl.experiments.workers.serving import Ended
from pbcs_ompl.experiments.workers.worker import Worker
from pbcs_ompl.results.provenance import PACKAGES, installed

Job = TypeVar("Job")
Record = TypeVar("Record")
SECONDS_TO_CONNECT = 10.0
RETRIES = 5
"""How often a run is begun anew because its node was lost."""
_workers: dict[tuple[Any, ...], Worker] = {}


@contextmanager
def ray_cluster(address: str = "auto", workers: int | None = None) -> Iterator[Executor]:
    """Connect to a cluster, see that its nodes have our versions, and give what executes runs there.

        with ray_cluster("head:6379") as cluster:
            compare(["Ex"], "pbcs/Maze-v0", jobs=cluster)

    Every run takes one processor of a node. Nodes may come and go: what was lost with a node is made again.

    Args:
        address: HOST:PORT of the cluster; "auto" for the one that this machine is a node of.
        workers: How many runs at a time; None for as many as the cluster has processors.

    Raises:
        MissingDependency: Ray is not installed.
        InvalidOption: there is no cluster at this address.
        Mismatch: nodes of the cluster have other versions of our libraries than this machine.
    """
    ray = _ray()
    with _connection(ray, address):
        _check_versions(ray)
        yield partial(_run_all, ray, workers)


def _run_all(ray: ModuleType, workers: int | None, jobs: Sequence[Job], run: Callable[[Job], Record],
             broken: Callable[[Job, str], Record], *, max_seconds: float | None,
             max_memory: float | None) -> Generator[Record, None, None]:
    task = ray.remote(num_cpus=1, max_retries=RETRIES)(_make)
    waiting = deque(jobs)
    going: dict[Any, Job] = {}
    try:
        while waiting or going:
            while waiting and len(going) < (workers or _places(ray)):
                job = waiting.popleft()
                going[task.remote(run, max_seconds, max_memory, job)] = job
            for reference in ray.wait(list(going))[0]:
                ended, job = _ended(ray, reference), going.pop(reference)
                yield ended.record if ended.reason is None else broken(job, ended.reason)
    finally:
        for reference in going:
            ray.cancel(reference, force=True)


def _make(run: Callable[[Any], Any], max_seconds: float | None, max_memory: float | None, job: Any) -> Ended:
    """Make a run on a node, in a process below Ray's, which lives as long as that and makes its other runs too."""
    key = (run, max_seconds, max_memory)
    if key not in _workers:
        _workers[key] = Worker(*key)
    return _workers[key].make(job)


def _ended(ray: ModuleType, reference: Any) -> Ended:
    try:
        return ray.get(reference)
    except ray.exceptions.RayError as error:
        return Ended(reason=f"Ray gave it up: {type(error).__name__}: {error}")


def _places(ray: ModuleType) -> int:
    """Return how many runs to hand over: twice as many as can go on, so that no processor waits for us."""
    return max(1, 2 * int(ray.cluster_resources().get("CPU", 0)))


def _ray() -> ModuleType:
    try:
        import ray
    except ModuleNotFoundError as error:
        raise MissingDependency("the executor ray needs Ray: pip install 'pbcs-ompl[ray]'") from error
    return ray


@contextmanager
def _connection(ray: ModuleType, address: str) -> Iterator[None]:
    """Connect to the cluster, unless this process is connected already."""
    if ray.is_initialized():
        yield
        return
    try:
        _knock(address)
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (OSError, ValueError) as error:
        raise InvalidOption(f"no Ray cluster at {address!r}: {error}; start one with: ray start --head") from error
    except RuntimeError as error:  # another Ray, or another Python
        raise Mismatch(f"cannot join the Ray cluster at {address!r}: {' '.join(str(error).split())}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _knock(address: str) -> None:
    """Raise OSError at once if nobody listens there; Ray itself would try for minutes."""
    host, _, port = address.partition(":")
    if port.isdecimal():
        socket.create_connection((host, int(port)), timeout=SECONDS_TO_CONNECT).close()


def _check_versions(ray: ModuleType) -> None:
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy as On

    here, task = _versions(), ray.remote(num_cpus=0)(_versions)
    asked = {node["NodeID"]: task.options(scheduling_strategy=On(node["NodeID"], soft=False)).remote()
             for node in ray.nodes() if node["Alive"]}
    differ = [f"node {node[:8]} has {', '.join(words)}"
              for node, reference in asked.items() if (words := _differences(ray, reference, here))]
    if differ:
        raise Mismatch(f"{'; '.join(differ)}; install the same versions on every node of the cluster")


def _differences(ray: ModuleType, reference: Any, here: dict[str, str]) -> list[str]:
    try:
        there = ray.get(reference)
    except ray.exceptions.RayError as error:
        return [f"not this package, or cannot import it ({type(error).__name__})"]
    return [f"{name} {there.get(name, 'missing')} (here {here.get(name, 'missing')})"
            for name in sorted(here.keys() | there.keys()) if here.get(name) != there.get(name)]


def _versions() -> dict[str, str]:
    return installed(PACKAGES)
