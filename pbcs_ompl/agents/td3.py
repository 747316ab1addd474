"""Twin delayed DDPG (Fujimoto, van Hoof and Meger, 2018), [Matheron2020] section 2.1.

Differs: none. Noise and its bound are measured in half-widths of the action box, as they are for a box of [-1, 1].
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.streams import normal
from pbcs_ompl.agents.trained_network import TrainedNetwork
from pbcs_ompl.core.types import Array


@dataclass(frozen=True)
class TD3Settings(AgentSettings):
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
        self._require("target_noise", self.target_noise >= 0.0, "at least 0")
        self._require("target_noise_clip", self.target_noise_clip >= 0.0, "at least 0")
        self._require("policy_delay", self.policy_delay >= 1, "at least 1")


class TD3(StackedAgent):
    """S TD3 agents as one stack; see `StackedAgent` for the arguments and methods."""

    settings_type = TD3Settings
    settings: TD3Settings

    def _make_networks(self, generators: Sequence[torch.Generator]) -> dict[str, TrainedNetwork]:
        self._actor = self._network(self.observation_size, self.action_size, generators)
        # The twins are one stack: the first critics of all seeds, then the second ones.
        self._critics = self._network(self.observation_size + self.action_size, 1, [*generators, *generators])
        return {"actor": self._actor, "critics": self._critics}

    def _inputs(self, first: int, count: int) -> Iterable[tuple[Any, ...]]:
        numbers, delay = range(first, first + count), self.settings.policy_delay
        critic_rates = self._adam_rates(self.settings.critic_learning_rate, numbers)
        actor_rates = self._adam_rates(self.settings.actor_learning_rate, [-(-n // delay) for n in numbers])
        noise = normal(self._noise_keys, first, count, (self.settings.batch_size, self.action_size))
        full = [number % delay == 0 for number in numbers]
        return zip(critic_rates, actor_rates, torch.from_numpy(noise).to(self.device), full, strict=True)

    def _update(self, rows: Tensor, critic_rate: Tensor, actor_rate: Tensor, noise: Tensor,
                full: bool) -> dict[str, Tensor]:
        """Make one update; the actor's loss is 0 in those that leave it alone."""
        batch = self._replay.unpack(rows)
        targets = self._targets(batch, noise)
        losses = self._critics.regress(batch.pairs.repeat(2, 1, 1), targets.repeat(2, 1, 1))
        self._critics.descend(critic_rate)
        critic_loss = losses.view(2, -1).sum(dim=0)
        if not full:
            return {"critic_loss": critic_loss, "actor_loss": torch.zeros_like(critic_loss)}
        actor_loss = self._actor_gradient(batch)
        self._actor.descend(actor_rate)
        self._actor.follow(self.settings.polyak)
        self._critics.follow(self.settings.polyak)
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}

    def _targets(self, batch: Batch, noise: Tensor) -> Tensor:
        """Return y = r + discount min_i Q'_i(s', pi'(s') + clipped noise) [S, B, 1], terminal transitions aside."""
        bound = self.settings.target_noise_clip
        noise = (noise * self.settings.target_noise).clamp_(-bound, bound)
        unit = self._actor.target_values(batch.next_observations).tanh_().add_(noise).clamp_(-1.0, 1.0)
        next_pairs = torch.cat((batch.next_observations, self._on_box(unit)), dim=2)
        twins = self._critics.target_values(next_pairs.repeat(2, 1, 1))
        next_values = torch.minimum(*twins.chunk(2))
        return torch.addcmul(batch.rewards, batch.continues, next_values, value=self.settings.discount)

    def _actor_gradient(self, batch: Batch) -> Tensor:
        """Return the mean over the batch of -Q_1(s, pi(s)) [S]; leave its gradient in the actor."""
        actor, critics = self._actor, self._critics
        outputs, actor_tape = actor.network.forward(actor.weights, batch.observations)
        unit = outputs.tanh()
        pairs = torch.cat((batch.observations, self._on_box(unit)), dim=2)
        values, tape = critics.network.forward(critics.weights, pairs.repeat(2, 1, 1))
        first, _ = values.chunk(2)
        slope = torch.cat((torch.full_like(first, -1.0 / first.shape[1]), torch.zeros_like(first)))
        slope, _ = critics.network.input_slope(critics.weights, tape, slope).chunk(2)
        slope = torch.ops.aten.tanh_backward(slope[..., self.observation_size :] * self._half, unit)
        actor.network.backward(actor.weights, actor_tape, slope, actor.gradient)
        return -first.mean(dim=(1, 2))

    def value(self, observations: Array, actions: Array) -> Array:
        """Return what the actor climbs: the first critics' values [S, B] of actions [S, B, A]."""
        pairs = self._pairs(observations, actions)
        with torch.inference_mode():
            first, _ = self._critics.values(pairs.repeat(2, 1, 1)).chunk(2)
            return first.squeeze(2).double().cpu().numpy()
