"""Where runs are executed: in worker processes here, or on a Ray cluster. Every job makes exactly one record."""

from pbcs_ompl.experiments.workers.executors import Executor, check_resources, run_all
from pbcs_ompl.experiments.workers.records import read_record
from pbcs_ompl.experiments.workers.shard import Shard

__all__ = ["Executor", "Shard", "check_resources", "read_record", "run_all"]
