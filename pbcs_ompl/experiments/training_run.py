"""One training as a study records it: a budget that ends first is a result too."""

import time
from typing import Any

from pbcs_ompl.core.errors import TrainingStalled
from pbcs_ompl.resettable import make
from pbcs_ompl.skills import TrainResult, evaluate, train


def trained(env: str, env_kwargs: dict[str, Any], **options: Any) -> tuple[dict[str, Any], TrainResult]:
    """Train, and return a record of plain values beside the result.

    The record is the summary of the result with `env_kwargs`, `transitions` (planning and training), `cpu_seconds` of
    the same, and `arrives`: whether what was learnt by the end, complete or not, reaches the target once without noise.

    Args:
        options: Those of `pbcs_ompl.train`.

    Raises:
        UnknownName, InvalidOption and others: as `pbcs_ompl.train`, but not TrainingStalled.
    """
    began = time.process_time()
    try:
        result = train(env, env_kwargs=env_kwargs, **options)
    except TrainingStalled as stalled:
        result = stalled.result
    spent = time.process_time() - began
    arrives = result.chain is not None and evaluate(result.chain, make(env, env_kwargs), episodes=1).success_rate == 1.0
    record = result.summary() | {"env_kwargs": env_kwargs, "cpu_seconds": spent, "arrives": arrives,
                                 "transitions": result.plan_transitions + result.train_transitions}
    return record, result
