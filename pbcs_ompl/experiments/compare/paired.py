"""Which of two planners needs fewer transitions: sign tests over the seeds that both have run."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import binomtest

from pbcs_ompl.experiments.compare.run import Record
from pbcs_ompl.experiments.compare.statistics import censored


def sign_tests(runs: Mapping[str, Sequence[Record]], max_transitions: int) -> list[dict[str, Any]]:
    """Compare every two planners, seed by seed, in one environment.

    A run that did not reach the goal is only known to need more than its budget. The sign of a difference survives
    that where one of the two runs was solved, its size does not: hence the sign test, and no test of ranks. Two
    unsolved runs are a tie; ties tell nothing.

    Args:
        runs: The records of each planner. Planners of which no run came to an end are left out.

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
