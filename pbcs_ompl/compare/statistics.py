"""One row of numbers for each planner."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.statistics import wilson

Record = dict[str, Any]
"""One run: planner, seed, solved, transitions, seconds, nodes, path_length, replay_ok, reason."""


def row(planner: str, records: Sequence[Record], max_transitions: int) -> dict[str, Any]:
    """Summarise the runs of one planner.

    A run that did not reach the goal counts in the medians of transitions as if it had needed the whole
    budget (right-censored): with fewer than half of the runs solved the median is the budget, a lower
    bound. Seconds are the wall time of the search, of all runs that ended by themselves.

    Returns:
        planner; solved and runs (counts); wilson [low, high] (95 %); transitions_median,
        transitions_quartiles, seconds_median (None where no run could be made); reason: why the first run
        that broke did, or None.
    """
    solved = sum(record["solved"] for record in records)
    ran = [record for record in records if record["seconds"] is not None]
    transitions = [record["transitions"] if record["solved"] else max_transitions for record in records]
    broken = [record["reason"] for record in records if record["seconds"] is None]
    return {
        "planner": planner, "solved": solved, "runs": len(records),
        "wilson": list(wilson(solved, len(records))),
        "transitions_median": _quantiles(transitions, [0.5])[0] if ran else None,
        "transitions_quartiles": _quantiles(transitions, [0.25, 0.75]) if ran else None,
        "seconds_median": _quantiles([record["seconds"] for record in ran], [0.5])[0] if ran else None,
        "reason": broken[0] if broken else None,
    }


def _quantiles(values: Sequence[float], levels: Sequence[float]) -> list[float]:
    return [float(value) for value in np.quantile(values, levels)]
