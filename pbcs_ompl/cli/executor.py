"""Where the runs of a command are executed."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.workers import Executor


@contextmanager
def executor(arguments: Namespace) -> Iterator[int | Executor]:
    """Give the number of processes here, or the cluster that was asked for."""
    if arguments.executor == "local":
        if arguments.address is not None:
            raise InvalidOption("--address names a Ray cluster; add --executor ray")
        yield arguments.jobs or 1
    else:
        from pbcs_ompl.experiments.workers.ray import ray_cluster

        with ray_cluster(arguments.address or "auto", arguments.jobs) as cluster:
            yield cluster
