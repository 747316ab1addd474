"""One row of numbers for each planner in each environment."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.experiments.compare.run import Record


def censored(record: Record, max_transitions: int) -> int:
    """Return the transitions to the goal, or the whole budget where it was not reached: a lower bound."""
    return int(record["transitions"]) if record["solved"] else max_transitions


def row(planner: str, records: Sequence[Record], max_transitions: int) -> dict[str, Any]:
    """Summarise the runs of one planner in one environment.

    A run that did not reach the goal counts in the medians of transitions as if it had needed the whole
    budget (right-censored): with fewer than half of the runs solved the median is the budget, a lower
    bound. The other medians are those of all runs that ended by themselves, the path's of all that were solved.

    Returns:
        planner; solved, runs, failed (counts; failed runs did not come to an end); wilson [low, high] (95 %);
        transitions_median and transitions_quartiles; the medians of seconds (wall time of the search),
        collision_checks, path_length and coverage, None where no run tells; reason: why the first that failed did.
    """
    solved = sum(record["solved"] for record in records)
    ran = [record for record in records if record["seconds"] is not None]
    transitions = [censored(record, max_transitions) for record in records]
    reasons = [record["reason"] for record in records if record["seconds"] is None]
    medians = {f"{name}_median": _median([record[name] for record in ran if record[name] is not None])
               for name in ("seconds", "collision_checks", "path_length", "coverage")}
    return {
        "planner": planner, "solved": solved, "runs": len(records), "failed": len(reasons),
        "wilson": list(wilson(solved, len(records))),
        "transitions_median": _median(transitions) if ran else None,
        "transitions_quartiles": np.quantile(transitions, [0.25, 0.75]).tolist() if ran else None,
        **medians, "reason": reasons[0] if reasons else None,
    }


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None
