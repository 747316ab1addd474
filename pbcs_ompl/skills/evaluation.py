"""How well a skill chain drives its environment."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.skills.chain import SkillChain


@dataclass(frozen=True)
class Evaluation:
    """Executions of a chain from its start.

    Attributes:
        success_rate: Share of the episodes that reached the target.
        wilson: Its 95 % Wilson interval.
        episodes: Number of executions.
        steps_median: Median steps of the successful ones; None when there are none.
        epsilon: Share of random actions.
    """

    success_rate: float
    wilson: tuple[float, float]
    episodes: int
    steps_median: float | None
    epsilon: float

    def summary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"success_rate": self.success_rate, "wilson": list(self.wilson), "episodes": self.episodes,
                "steps_median": self.steps_median, "epsilon": self.epsilon}


def evaluate(chain: SkillChain, model: ResettableModel, *, episodes: int = 100, epsilon: float = 0.0,
             seed: int = 0) -> Evaluation:
    """Execute the chain `episodes` times from the state it was trained to start from.

    In an environment that draws its start or its goal anew at each reset, that is one of many: a chain is a controller
    for one task, robust to disturbances, not a solution of all tasks.

    Args:
        epsilon: Share of actions that are replaced by random ones.
        seed: Of the random actions.

    Raises:
        Mismatch: the chain was trained in another environment.
        InvalidOption: no episodes, or an epsilon outside [0, 1].
    """
    if episodes < 1:
        raise InvalidOption(f"episodes = {episodes}, expected at least 1")
    if not 0 <= epsilon <= 1:
        raise InvalidOption(f"epsilon = {epsilon}, expected a share in [0, 1]")
    chain.check_belongs_to(model)
    starts = np.repeat(chain.start[None], episodes, axis=0)
    rollouts = chain.rollouts(model, starts, epsilon=epsilon,
                              rng=SeedTree(seed).child("evaluation").generator())
    arrived = int(rollouts.success.sum())
    steps = float(np.median(rollouts.steps[rollouts.success])) if arrived else None
    return Evaluation(arrived / episodes, wilson(arrived, episodes), episodes, steps, epsilon)
