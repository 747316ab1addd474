"""What a comparison says of planners: a row of numbers for each, and which of two needs fewer transitions."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import binomtest

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.experiments.run import Record


def censored(record: Record, max_transitions: int) -> int:
    """Return the transitions to the goal, or the whole budget where it was not reached: a lower bound."""
    return int(record["transitions"]) if record["solved"] else max_transitions


def planner_row(planner: str, records: Sequence[Record], max_transitions: int) -> dict[str, Any]:
    """Summarise the runs of one planner in one environment.

    A run that did not reach the goal counts in the medians of transitions as if it had needed the whole
    budget (right-censored): with fewer than half of the runs solved the median is the budget, a lower
    bound. The other medians are those of all runs that did not fail, the path's of all that were solved.

    Args:
        planner: Its name.
        records: Those of its runs.
        max_transitions: The budget of a run.

    Returns:
        planner; solved, runs, failed (counts; a failed run has a reason and no measurements); wilson [low, high], 95 %;
        transitions_median and transitions_quartiles; the medians of seconds (wall time of the search),
        collision_checks, path_length and coverage, None where no run has them; reason: why the first failed run failed.
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


def sign_tests(runs: Mapping[str, Sequence[Record]], max_transitions: int) -> list[dict[str, Any]]:
    """Compare every two planners, seed by seed, in one environment.

    A run that did not reach the goal is only known to need more than its budget. The sign of a difference survives
    that where one of the two runs was solved, its size does not: hence the sign test, and no test of ranks. Two
    unsolved runs are a tie; ties say nothing.

    Args:
        runs: The records of each planner. Planners of which all runs failed are left out.
        max_transitions: The budget of a run.

    Returns:
        For each pair: planners [2]; fewer [2], in how many seeds each needed fewer transitions; ties; p, two-sided.
    """
    values = {planner: {record["seed"]: censored(record, max_transitions) for record in records}
              for planner, records in runs.items() if any(record["seconds"] is not None for record in records)}
    tests = []
    for first, second in combinations(values, 2):
        seeds = values[first].keys() & values[second].keys()
        signs = [np.sign(values[second][seed] - values[first][seed]) for seed in seeds]
        fewer = [signs.count(1), signs.count(-1)]
        tests.append({"planners": [first, second], "fewer": fewer, "ties": signs.count(0),
                      "p": float(binomtest(fewer[0], sum(fewer)).pvalue) if sum(fewer) else 1.0})
    return tests


def holm(chances: Sequence[float]) -> list[float]:
    """Return p-values corrected for their number: rejecting those below a errs at all with probability a at most.

    Source: Holm 1979, "A simple sequentially rejective multiple test procedure".
    """
    order = np.argsort(chances, kind="stable")
    steps = np.array(chances)[order] * np.arange(len(chances), 0, -1)
    corrected = np.empty(len(chances))
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(steps))
    return corrected.tolist()
