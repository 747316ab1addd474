"""What a stacked training records of each seed, and the records of several stacks as one."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray, IndexArray


@dataclass
class Curves:
    """What happened to each seed.

    Attributes:
        steps: When the agents were evaluated [E]; the first time before any training.
        success: Whether the policy without noise solved the environment then [E, S].
        first_reward: The step of the first positive reward [S], counted from 1; -1 for never.
        rewarded: Share of transitions with a positive reward in the replay buffer at each evaluation [E, S], and so the
            expected share in mini-batches.
        observed: What each observer returned at each evaluation, by name [E, S].
        solved_at: The step after which each seed left the stack, solved [S]; -1 where it stayed. Later rows repeat its
            last numbers.
        ended: The steps that were made; less than asked for if all seeds left before.
    """

    seeds: tuple[int, ...]
    steps: list[int] = field(default_factory=list)
    success: list[BoolArray] = field(default_factory=list)
    first_reward: IndexArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    rewarded: list[Array] = field(default_factory=list)
    observed: dict[str, list[Array]] = field(default_factory=dict)
    solved_at: IndexArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    ended: int = 0

    def summary(self) -> dict[str, object]:
        """Return plain values for a record."""
        return {"seeds": list(self.seeds), "steps": self.steps, "success": np.array(self.success).astype(int).tolist(),
                "first_reward": self.first_reward.tolist(), "rewarded": np.array(self.rewarded).round(6).tolist(),
                "observed": {name: np.array(values).round(5).tolist() for name, values in self.observed.items()},
                "solved_at": self.solved_at.tolist(), "ended": self.ended}


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
    """Return what an observer returned at the end of each stack [S]."""
    return np.concatenate([np.array(record["observed"][name][-1]) for record in records])


def _filled(rows: list[list[float]], count: int) -> Array:
    table = np.array(rows)
    return np.concatenate([table, np.repeat(table[-1:], count - len(table), axis=0)])
