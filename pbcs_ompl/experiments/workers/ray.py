"""Runs on a Ray cluster, each in a worker process as on one machine; a node that is lost costs no run."""

import socket
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import ModuleType
from typing import Any

from pbcs_ompl.core.errors import InvalidOption, Mismatch, MissingDependency
from pbcs_ompl.experiments.run import Failure, Record, Run, RunFunction
from pbcs_ompl.experiments.workers.executors import Executor
from pbcs_ompl.experiments.workers.worker import Limits, Worker
from pbcs_ompl.results.provenance import PACKAGES, installed

SECONDS_TO_CONNECT = 10.0
RETRIES = 5
"""How often a run is started again because its node was lost."""
_workers: dict[tuple[RunFunction, Limits], Worker] = {}
"""The workers of this process, which Ray started on a node. Each lives as long as the process and makes many runs."""


@contextmanager
def ray_cluster(address: str = "auto", jobs: int | None = None) -> Iterator[Executor]:
    """Connect to a cluster, check that its nodes have the same versions, and yield what executes runs there.

        with ray_cluster("head:6379") as cluster:
            compare(["Ex"], "pbcs/Maze-v0", jobs=cluster)

    Every run takes one processor of a node. Nodes may join and leave: a run whose node is lost is made again.

    Args:
        address: HOST:PORT of the cluster; "auto" for the one that this machine is a node of.
        jobs: How many runs at a time; None for as many as the cluster has processors.

    Raises:
        MissingDependency: Ray is not installed.
        InvalidOption: there is no cluster at this address.
        Mismatch: nodes of the cluster have other versions of the libraries than this machine.
    """
    ray = _ray()
    with _connection(ray, address):
        _check_versions(ray)
        yield partial(_run_on_cluster, ray, jobs)


def _run_on_cluster(ray: ModuleType, jobs: int | None, runs: Sequence[Run], function: RunFunction,
                    limits: Limits) -> Generator[tuple[Run, Record | Failure], None, None]:
    task = ray.remote(num_cpus=1, max_retries=RETRIES)(_make)
    waiting = deque(runs)
    running: dict[Any, Run] = {}
    try:
        while waiting or running:
            while waiting and len(running) < (jobs or _places(ray)):
                run = waiting.popleft()
                running[task.remote(function, limits, run)] = run
            for reference in ray.wait(list(running))[0]:
                found, run = _found(ray, reference), running.pop(reference)
                yield run, found
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def _make(function: RunFunction, limits: Limits, run: Run) -> Record | Failure:
    """Make a run on a node, in a process below that of Ray."""
    key = (function, limits)
    if key not in _workers:
        _workers[key] = Worker(function, limits)
    return _workers[key].make(run)


def _found(ray: ModuleType, reference: Any) -> Record | Failure:
    try:
        found: Record | Failure = ray.get(reference)
    except ray.exceptions.RayError as error:
        return Failure(f"Ray gave it up: {type(error).__name__}: {error}")
    return found


def _places(ray: ModuleType) -> int:
    """Return how many runs to submit: twice as many as there are processors, so that none waits for this machine."""
    return max(1, 2 * int(ray.cluster_resources().get("CPU", 0)))


def _ray() -> ModuleType:
    try:
        import ray
    except ModuleNotFoundError as error:
        raise MissingDependency("the executor ray needs Ray: pip install 'pbcs-ompl[ray]'") from error
    module: ModuleType = ray
    return module


@contextmanager
def _connection(ray: ModuleType, address: str) -> Iterator[None]:
    """Connect to the cluster, unless this process is connected already."""
    if ray.is_initialized():
        yield
        return
    try:
        _check_reachable(address)
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except (OSError, ValueError) as error:
        raise InvalidOption(f"no Ray cluster at {address!r}: {error}; start one with: ray start --head") from error
    except RuntimeError as error:  # another Ray, or another Python
        raise Mismatch(f"cannot join the Ray cluster at {address!r}: {' '.join(str(error).split())}") from error
    try:
        yield
    finally:
        ray.shutdown()


def _check_reachable(address: str) -> None:
    """Raise OSError at once if nothing listens there; Ray itself would try for minutes."""
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
