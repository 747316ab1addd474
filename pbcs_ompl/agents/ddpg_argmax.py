"""DDPG-argmax, [Matheron2020] section 6.6.2: DDPG whose actor imitates the best of some random actions.

The critic is that of DDPG (Eq. 1.2), and still learns from the target actor; the policy gradient (Eq. 1.5) is replaced:

    b_j uniform in the action box, for j < N
    c_i = the b_j with the largest Q(s_i, b_j)
    minimise sum_i (pi(s_i) - c_i)^2

Differs: the loss is a mean over the mini-batch, and distances are measured in half-widths of the box, so that all
dimensions of an action weigh the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.counter_rng import uniform
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.losses import ActionBox, Network
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.core.options import check_range


@dataclass(frozen=True)
class DDPGArgmaxSettings(AgentSettings):
    """Settings of DDPG-argmax.

    Attributes:
        candidates: Random actions N of an update, the same for the whole mini-batch.
    """

    algorithm = "ddpg-argmax"

    candidates: int = 100

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("candidates", self.candidates, self.candidates >= 1, "at least 1")


class DDPGArgmax(StackedAgent):
    """S DDPG-argmax agents as one stack; see `StackedAgent` for the arguments and methods."""

    settings_type = DDPGArgmaxSettings
    settings: DDPGArgmaxSettings
    gradients = GRADIENTS

    def update_inputs(self, first: int, count: int) -> tuple[Sequence[Any] | Tensor, ...]:
        """Return rates and the candidates [S, N, A], in [-1, 1]."""
        drawn = uniform(self.stream_keys, first, count, (self.settings.candidates, self.action_size))
        return *self.adam_rates(first, count), torch.from_numpy(2.0 * drawn - 1.0).to(self.device)

    def update(self, batch: Batch, critic_rate: Tensor, actor_rate: Tensor, candidates: Tensor) -> dict[str, Tensor]:
        """Make one update; see `StackedAgent.update`."""
        critic_loss = self.minimise(self.critic, critic_rate, losses.critic_loss,
                                    batch.obs_actions, self.td_targets(batch))
        best = best_candidates(self.critic.weights, batch.observations, candidates, self.box)
        actor_loss = self.minimise(self.actor, actor_rate, losses.imitation_loss, batch.observations, best)
        self.update_targets()
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}


def best_candidates(critic: Network, observations: Tensor, candidates: Tensor, box: ActionBox) -> Tensor:
    """Return the candidate with the largest value for each observation [S, B, A].

    Args:
        critic: Q.
        observations: [S, B, O].
        candidates: Actions in [-1, 1] [S, N, A].
        box: Of the actions.
    """
    seeds, batch, _ = observations.shape
    count = candidates.shape[1]
    every = torch.cat((observations.repeat_interleave(count, dim=1), box.scale(candidates).repeat(1, batch, 1)), dim=2)
    choice = critic(every).view(seeds, batch, count).argmax(dim=2)
    return candidates.gather(1, choice[:, :, None].expand(-1, -1, candidates.shape[2]))
