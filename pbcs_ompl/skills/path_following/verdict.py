"""Whether a policy passes a test by executions, and where those that failed came to their ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from pbcs_ompl.core.types import IndexArray
from pbcs_ompl.skills.path_following.task import Position
from pbcs_ompl.skills.sequential_test import SequentialTest

FIRST_TRIALS, MOST_TRIALS = 4, 8
"""Noisy executions of a test side by side before the sequential test is asked: first, and later."""


class Verdict(NamedTuple):
    """The result of a test: whether the policy passed, its success rate with noise, where its failures ended."""

    passed: bool
    rate: float
    blocked: int


@dataclass(frozen=True, eq=False)
class Trouble:
    """Where executions of a refused test failed.

    Attributes:
        before: Where they were shortly before [F].
        ends: The pointers at which they came to their ends [F].
    """

    before: Position
    ends: IndexArray

    @classmethod
    def together(cls, troubles: Sequence["Trouble"]) -> Self:
        """Return several as one."""
        return cls(Position.together([one.before for one in troubles]), np.concatenate([one.ends for one in troubles]))


def judged(gate: SequentialTest, starts: int, failures: Callable[[IndexArray], Trouble]) -> tuple[Verdict, Trouble]:
    """Execute until the sequential test has an answer; return it, and where executions failed.

    Args:
        gate: The sequential test.
        starts: Number of starts, which take turns.
        failures: Executes from some of the starts, by their indices [B], and returns where those that fail do.
    """
    found = list[Trouble]()
    trials, failed, passed = 0, 0, None
    while passed is None:
        count = min(MOST_TRIALS if trials else FIRST_TRIALS, gate.most_needed(trials - failed, trials))
        found.append(failures((trials + np.arange(count)) % starts))
        trials += count
        failed += len(found[-1].ends)
        passed = gate.verdict(trials - failed, trials)
    trouble = Trouble.together(found)
    return Verdict(passed, 1.0 - failed / trials, int(trouble.ends.max(initial=0))), trouble
