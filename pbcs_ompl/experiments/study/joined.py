"""Join the records of many stacks into one table of seeds."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray, IndexArray


def chunks(seeds: int, size: int) -> Iterator[list[int]]:
    """Yield the seeds 0, 1, ... in stacks of at most `size`."""
    for first in range(0, seeds, size):
        yield list(range(first, min(first + size, seeds)))


def joined_success(records: Sequence[dict[str, Any]], steps: int, every: int) -> tuple[IndexArray, BoolArray]:
    """Return when the seeds of all stacks were evaluated [E], and which were solved then [E, S].

    A stack that ended early, all its seeds solved, counts as solved from then on.

    Args:
        records: Summaries of `Curves`.
        steps, every: The settings that all of them have, `steps` and `evaluate_every`.
    """
    times = np.arange(0, steps + 1, every)
    return times, joined_rows(records, "success", len(times)) > 0


def joined_rows(records: Sequence[dict[str, Any]], name: str, count: int) -> Array:
    """Return rows, such as "success" or "rewarded", of all stacks at `count` evaluations [E, S].

    The last row of a stack that ended early is repeated.
    """
    return np.concatenate([_filled(record[name], count) for record in records], axis=1)


def joined_first_rewards(records: Sequence[dict[str, Any]]) -> IndexArray:
    """Return the step of the first reward of each seed [S]; -1 for never."""
    return np.concatenate([np.array(record["first_reward"], dtype=np.int64) for record in records])


def joined_observed(records: Sequence[dict[str, Any]], name: str) -> Array:
    """Return what an observer said at the end of each stack [S]."""
    return np.concatenate([np.array(record["observed"][name][-1]) for record in records])


def _filled(rows: list[list[float]], count: int) -> Array:
    table = np.array(rows)
    return np.concatenate([table, np.repeat(table[-1:], count - len(table), axis=0)])
