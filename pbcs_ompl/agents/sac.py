"""Soft actor-critic with a learnt temperature (Haarnoja et al., 2018), [Matheron2020] sections 2.1 and 6.6.

The policy is tanh(u), u normal with mean and log standard deviation given by the actor, scaled to the action box.
Densities are measured in half-widths of the box, as they are for a box of [-1, 1]. What `act` returns, and what remains
of it as a `Policy`, is the deterministic tanh(mean).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import Any

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.counter_rng import normal, stream_keys
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.kernels.updates import SAC_KERNEL
from pbcs_ompl.agents.networks import TrainedNetwork, TrainedScalar
from pbcs_ompl.agents.policy import to_box
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.several_critics import CriticsSettings, chosen_critics, teach_critics
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.types import Array


@dataclass(frozen=True)
class SACSettings(CriticsSettings):
    """Settings of SAC.

    Attributes:
        temperature: Weight of the entropy against the reward, before the first update.
        temperature_learning_rate: 0 keeps the temperature as it is; else it is learnt such that the entropy of the
            policy is -A, for A actions.
    """

    algorithm = "sac"

    temperature: float = 0.1
    temperature_learning_rate: float = 1e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("temperature", self.temperature, self.temperature > 0.0, "a positive number")
        rate = self.temperature_learning_rate
        check_range("temperature_learning_rate", rate, rate >= 0.0, "at least 0")


class SAC(StackedAgent):
    """S SAC agents as one stack; see `StackedAgent` for the arguments and methods.

    Among the losses that `train` returns is the mean temperature.
    """

    settings_type = SACSettings
    settings: SACSettings
    gradients = GRADIENTS
    kernel = SAC_KERNEL
    outputs_per_action = 2

    @property
    def num_critics(self) -> int:
        """Critics of each seed."""
        return self.settings.critics

    @property
    def is_averaged(self) -> bool:
        """Whether the actor learns from the mean of the critics, as in REDQ, or from the least value, as in SAC."""
        return self.settings.target_critics < self.settings.critics

    def make_networks(self, generators: Sequence[np.random.Generator]) -> dict[str, TrainedNetwork | TrainedScalar]:
        """Return actor, critics, and the logarithm of the temperature."""
        initial = torch.full((len(self.seeds),), log(self.settings.temperature))
        self.log_temperature = TrainedScalar(initial, self.device)
        self._sample_keys = stream_keys(self.seeds, "samples")
        self._num_samples = torch.zeros(1, dtype=torch.int64)
        return {**super().make_networks(generators), "temperature": self.log_temperature}

    def tensors(self) -> dict[str, Tensor]:
        """Return all that `StackedAgent.tensors` returns, and how many actions were drawn."""
        return super().tensors() | {"num_samples": self._num_samples}

    def part(self, seeds: Sequence[int]) -> dict[str, Tensor]:
        """Return copies of `tensors()` for some seeds, by their indices."""
        return super().part(seeds) | {"num_samples": self._num_samples.clone()}

    def update_inputs(self, first: int, count: int) -> tuple[Sequence[Any] | Tensor, ...]:
        """Return rates, noise [S, 2, B, A] for the actions in the next and present states, and critics [S, C]."""
        rates = (*self.adam_rates(first, count),
                 self.rates_of(self.settings.temperature_learning_rate, range(first, first + count)))
        noise = normal(self.stream_keys, first, count, (2, self.settings.batch_size, self.action_size))
        chosen = chosen_critics(self.settings, self.seeds, first, count)
        return *rates, *(torch.from_numpy(drawn).to(self.device) for drawn in (noise, chosen))

    def update(self, batch: Batch, critic_rate: Tensor, actor_rate: Tensor, temperature_rate: Tensor,
               noise: Tensor, chosen: Tensor) -> dict[str, Tensor]:
        """Make one update; see `StackedAgent.update`."""
        temperature = self.log_temperature.values.exp()
        targets = self.soft_targets(batch, noise[:, 0], chosen, temperature)
        critic_loss = teach_critics(self, batch, critic_rate, targets)
        actor_loss, log_density = self.minimise(self.actor, actor_rate, losses.soft_policy_loss, self.critic.weights,
                                                batch.observations, noise[:, 1], temperature, self.box,
                                                losses.CriticStack(self.num_critics, self.is_averaged))
        self.minimise(self.log_temperature, temperature_rate, losses.temperature_loss, log_density, -self.action_size)
        self.critic.update_target(self.settings.polyak)
        return {"critic_loss": critic_loss, "actor_loss": actor_loss, "temperature": temperature}

    def soft_targets(self, batch: Batch, noise: Tensor, chosen: Tensor, temperature: Tensor) -> Tensor:
        """Return y = r + discount (min_i Q'_i(s', a') - temperature log pi(a'|s')) [S, B, 1], or r at the end.

        Args:
            batch: The mini-batches.
            noise: Standard normal numbers [S, B, A], of which a' is made.
            chosen: Whether a critic is among those with i [S, C].
            temperature: [S].
        """
        squashed, log_density = losses.sample_squashed(self.actor.weights(batch.next_observations), noise)
        inputs = self.box.join(batch.next_observations, squashed).repeat(self.num_critics, 1, 1)
        next_values = losses.least_values(self.critic.target(inputs), chosen)
        next_values = next_values - temperature[:, None, None] * log_density
        return losses.td_targets(batch.rewards, batch.not_done, next_values, self.settings.discount)

    def explore(self, observations: Array) -> Array:
        """Return actions [S, B, A] drawn from the policies."""
        count = observations.shape[1]
        noise = normal(self._sample_keys, int(self._num_samples), count, (self.action_size,)).swapaxes(0, 1)
        with torch.inference_mode():
            outputs = self.actor.weights(self.observed(observations))
            squashed, _ = losses.sample_squashed(outputs, torch.from_numpy(noise).to(self.device))
            self._num_samples += count
            return to_box(squashed.cpu().numpy(), self.action_low, self.action_high)

    def value(self, observations: Array, actions: Array) -> Array:
        """Return what the actor maximises: the critics' least or mean values [S, B] of actions [S, B, A]."""
        values = self.critic_values(observations, actions).reshape(self.num_critics, len(self.seeds), -1)
        maximised: Array = values.mean(axis=0) if self.is_averaged else values.min(axis=0)
        return maximised
