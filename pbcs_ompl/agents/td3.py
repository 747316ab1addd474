"""Twin delayed DDPG (Fujimoto, van Hoof and Meger, 2018), [Matheron2020] section 2.1.

Differs: none. Noise and its bound are measured in half-widths of the action box, as they are for a box of [-1, 1].
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.counter_rng import normal
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.kernels.updates import TD3_KERNEL
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.several_critics import CriticsSettings, chosen_critics, teach_critics
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.core.options import check_range


@dataclass(frozen=True)
class TD3Settings(CriticsSettings):
    """Settings of TD3.

    Attributes:
        target_noise: Standard deviation of the noise on the target's actions.
        target_noise_clip: The largest such noise.
        policy_delay: Updates of the critics for each update of the actor and the targets.
    """

    algorithm = "td3"

    target_noise: float = 0.2
    target_noise_clip: float = 0.5
    policy_delay: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("target_noise", self.target_noise, self.target_noise >= 0.0, "at least 0")
        check_range("target_noise_clip", self.target_noise_clip, self.target_noise_clip >= 0.0, "at least 0")
        check_range("policy_delay", self.policy_delay, self.policy_delay >= 1, "at least 1")


class TD3(StackedAgent):
    """S TD3 agents as one stack; see `StackedAgent` for the arguments and methods."""

    settings_type = TD3Settings
    settings: TD3Settings
    gradients = GRADIENTS
    kernel = TD3_KERNEL

    @property
    def num_critics(self) -> int:
        """Critics of each seed."""
        return self.settings.critics

    def update_inputs(self, first: int, count: int) -> tuple[Sequence[Any] | Tensor, ...]:
        """Return rates, noise [S, B, A] on the target's actions, its critics [S, C], and whether the actor learns."""
        numbers, delay = range(first, first + count), self.settings.policy_delay
        critic_rates, _ = self.adam_rates(first, count)
        actor_rates = self.rates_of(self.settings.actor_learning_rate, [-(-n // delay) for n in numbers])
        bound = np.float32(self.settings.target_noise_clip)
        noise = normal(self.stream_keys, first, count, (self.settings.batch_size, self.action_size))
        noise = np.clip(np.float32(self.settings.target_noise) * noise, -bound, bound)
        full = [number % delay == 0 for number in numbers]
        chosen = torch.from_numpy(chosen_critics(self.settings, self.seeds, first, count)).to(self.device)
        return critic_rates, actor_rates, torch.from_numpy(noise).to(self.device), chosen, full

    def update(self, batch: Batch, critic_rate: Tensor, actor_rate: Tensor, noise: Tensor, chosen: Tensor,
               full: bool) -> dict[str, Tensor]:
        """Make one update; the actor's loss is 0 in those that leave it as it is."""
        targets = self.smoothed_targets(batch, noise, chosen)
        critic_loss = teach_critics(self, batch, critic_rate, targets)
        if not full:
            return {"critic_loss": critic_loss, "actor_loss": torch.zeros_like(critic_loss)}
        first = self.critic.weights.first(len(self.seeds))
        actor_loss = self.minimise(self.actor, actor_rate, losses.policy_loss, first, batch.observations, self.box)
        self.update_targets()
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}

    def smoothed_targets(self, batch: Batch, noise: Tensor, chosen: Tensor) -> Tensor:
        """Return y = r + discount min_i Q'_i(s', pi'(s') + noise) [S, B, 1], or r at the end; i is chosen [S, C]."""
        squashed = self.actor.target(batch.next_observations).tanh_().add_(noise).clamp_(-1.0, 1.0)
        inputs = self.box.join(batch.next_observations, squashed).repeat(self.num_critics, 1, 1)
        next_values = losses.least_values(self.critic.target(inputs), chosen)
        return losses.td_targets(batch.rewards, batch.not_done, next_values, self.settings.discount)
