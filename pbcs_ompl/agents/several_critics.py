"""Algorithms with several critics, which learn from the least of their values.

Two critics are those of TD3 and SAC. More of them, of which each update draws a few for its target, are those of
REDQ (Chen et al., 2021) and RLPD (Ball et al., 2023): they bear many updates for each transition.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.counter_rng import stream_keys, uniform
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.types import BoolArray

MOST_CRITICS = 100


@dataclass(frozen=True)
class CriticsSettings(AgentSettings):
    """Settings of an algorithm with several critics.

    Attributes:
        critics: How many each seed has.
        target_critics: How many of them, drawn for each update, give its target: the least of their values.
    """

    critics: int = 2
    target_critics: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("critics", self.critics, 1 <= self.critics <= MOST_CRITICS, f"from 1 to {MOST_CRITICS}")
        check_range("target_critics", self.target_critics, 1 <= self.target_critics <= self.critics,
                    f"from 1 to critics, which is {self.critics}")


def chosen_critics(settings: CriticsSettings, seeds: Sequence[int], first: int, count: int) -> BoolArray:
    """Return which critics give the targets [count, S, C] of updates number first, first + 1, ... (from 1).

    Args:
        settings: How many there are, and how many are chosen.
        seeds: Of the agents; what is drawn for one does not depend on the others.
        first, count: Which updates.
    """
    shape = (count, len(seeds), settings.critics)
    if settings.target_critics == settings.critics:
        return np.ones(shape, dtype=bool)
    drawn = uniform(stream_keys(seeds, "critics"), first, count, shape[2:])
    chosen: BoolArray = drawn.argsort(axis=2).argsort(axis=2) < settings.target_critics
    return chosen


def teach_critics(agent: StackedAgent, batch: Batch, rate: Tensor, targets: Tensor) -> Tensor:
    """Make a step of all critics of each seed towards the same targets; return the sums of their losses [S].

    Args:
        agent: With the critics.
        batch: The mini-batches [S, B, ...].
        rate: Of this step of Adam.
        targets: [S, B, 1].
    """
    copies = agent.num_critics, 1, 1
    each: Tensor = agent.minimise(agent.critic, rate, losses.critic_loss, batch.obs_actions.repeat(copies),
                                  targets.repeat(copies))
    return each.view(agent.num_critics, -1).sum(dim=0)
