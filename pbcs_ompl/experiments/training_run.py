"""One training as a study records it, solved or not."""

import time
from typing import Any

from pbcs_ompl.skills import TrainResult, evaluate, train


def trained(env: str, env_kwargs: dict[str, Any], **options: Any) -> tuple[dict[str, Any], TrainResult]:
    """Train, and return a record of plain values beside the result.

    The record is the summary of the result with `env_kwargs`, `transitions` (planning and training), `cpu_seconds` of
    the same, and `succeeds`: whether the chain at the end, complete or not, reaches the goal once without noise.

    Args:
        env: The id of an environment.
        env_kwargs: Its options.
        options: Those of `pbcs_ompl.train`.

    Raises:
        UnknownName, InvalidOption and others: as `pbcs_ompl.train`.
    """
    began = time.process_time()
    result = train(env, env_kwargs=env_kwargs, **options)
    spent = time.process_time() - began
    evaluation = None if result.chain is None else evaluate(result.chain, episodes=1)
    succeeds = evaluation is not None and evaluation.success_rate == 1.0
    record = result.summary() | {"env_kwargs": env_kwargs, "cpu_seconds": spent, "succeeds": succeeds,
                                 "transitions": result.plan_transitions + result.train_transitions}
    return record, result
