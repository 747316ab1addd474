"""Where runs are executed: in worker processes here, or on a Ray cluster. Every run ends with a record or a failure."""

from pbcs_ompl.experiments.workers.executors import Executor, make_executor
from pbcs_ompl.experiments.workers.worker import Limits

__all__ = ["Executor", "Limits", "make_executor"]
