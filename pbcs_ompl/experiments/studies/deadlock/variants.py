"""The records of the deadlock study by variant: when seeds were solved, when they first met the reward."""

from typing import Any

import numpy as np

from pbcs_ompl.experiments.claims import Rate, rate
from pbcs_ompl.experiments.training_curves import joined_first_rewards, joined_observed, joined_success

EARLY = 50
GREEDY, OU, TD3 = "ddpg-epsilon-greedy", "ddpg-ornstein-uhlenbeck", "td3-epsilon-greedy"
SAC, ARGMAX, REGRESSION = "sac-epsilon-greedy", "ddpg-argmax-epsilon-greedy", "ddpg-regression-epsilon-greedy"
NAMES = {GREEDY: "DDPG, ε-greedy noise", OU: "DDPG, Ornstein-Uhlenbeck noise",
         f"{GREEDY}-expert": "DDPG, ε-greedy, then optimal behaviour",
         f"{OU}-expert": "DDPG, Ornstein-Uhlenbeck, then optimal behaviour", TD3: "TD3",
         REGRESSION: "DDPG, regression (Eq. 6.5)", SAC: "SAC",
         ARGMAX: "DDPG-argmax"}
"""What a reader calls the variants."""


class Variant:
    """All seeds of one variant: when they were solved, and when they first met the reward."""

    def __init__(self, records: list[dict[str, Any]]):
        loop = records[0]["loop"]
        self.records, self.expert_after = records, records[0]["expert_after"]
        variant = str(records[0]["variant"])
        self.name = NAMES.get(variant, variant)
        self.steps, self.success = joined_success(records, loop["steps"], loop["evaluate_every"])
        self.first = joined_first_rewards(records)
        self.failed = ~self.success[-1]
        self.rewarded = np.concatenate([np.array(record["rewarded"][-1]) for record in records])
        self.early = (self.first > 0) & (self.first <= EARLY)
        self.seeds = np.concatenate([record["seeds"] for record in records])
        self.critics = [critic for record in records for critic in record["critics"]]

    def observed(self, name: str) -> np.ndarray:
        """Return what an observer said at the end [S]."""
        values: np.ndarray = joined_observed(self.records, name)
        return values

    @property
    def failed_with_reward(self) -> np.ndarray:
        """Which seeds failed although they had met the reward [S]."""
        chosen: np.ndarray = self.failed & (self.first > 0)
        return chosen

    @property
    def half(self) -> int | None:
        """The first evaluation at which more than half of the seeds were solved."""
        rows = np.flatnonzero(self.success.mean(axis=1) > 0.5)
        return int(self.steps[rows[0]]) if len(rows) else None

    @property
    def failures(self) -> Rate:
        """The rate of failure."""
        return rate(self.failed.sum(), len(self.failed))

    def solved_of(self, chosen: np.ndarray) -> Rate:
        """Return the rate of success of some seeds [S]."""
        return rate((chosen & ~self.failed).sum(), chosen.sum())


def variants_of(records: list[dict[str, Any]]) -> dict[str, Variant]:
    """Return the variants in the order of the records."""
    names = dict.fromkeys(record["variant"] for record in records if record["variant"] != "drift")
    return {name: Variant([record for record in records if record["variant"] == name]) for name in names}
