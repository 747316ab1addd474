"""Soft actor-critic with a learnt temperature (Haarnoja et al., 2018), [Matheron2020] sections 2.1 and 6.6.

The policy is tanh(u), u normal with mean and log-deviation given by the actor, mapped onto the action box. Densities
are measured in half-widths of the box, as they are for a box of [-1, 1]. What `act` returns, and what remains of it as
a `Policy`, is the deterministic tanh(mean).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import log, pi
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import softplus

from pbcs_ompl.agents.networks import Tape
from pbcs_ompl.agents.policy import to_box
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.streams import normal, stream_keys
from pbcs_ompl.agents.trained_network import TrainedNetwork, TrainedTensor
from pbcs_ompl.core.types import Array

LOG_DEVIATION = -20.0, 2.0
"""Bounds of the actor's log-deviation; outside of them it has no slope."""


@dataclass(frozen=True)
class SACSettings(AgentSettings):
    """Settings of SAC.

    Attributes:
        temperature: Weight of the entropy against the reward; where learning starts.
        temperature_learning_rate: 0 keeps the temperature as it is; else it is learnt such that the entropy of the
            policy is -A, for A actions.
    """

    algorithm = "sac"

    temperature: float = 0.1
    temperature_learning_rate: float = 1e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require("temperature", self.temperature > 0.0, "a positive number")
        self._require("temperature_learning_rate", self.temperature_learning_rate >= 0.0, "at least 0")


class Sample(NamedTuple):
    """A batch of actions drawn from the policy, and what their slopes need."""

    unit: Tensor
    """tanh(u) [S, B, A]"""
    log_density: Tensor
    """[S, B, 1]"""
    deviation: Tensor
    """[S, B, A]"""
    free: Tensor
    """Whether the log-deviation is inside of its bounds [S, B, A]."""
    tape: Tape


class SAC(StackedAgent):
    """S SAC agents as one stack; see `StackedAgent` for the arguments and methods.

    Among the losses that `train` returns is the mean temperature.
    """

    settings_type = SACSettings
    settings: SACSettings

    def _make_networks(self, generators: Sequence[torch.Generator]) -> dict[str, TrainedNetwork]:
        self._actor = self._network(self.observation_size, 2 * self.action_size, generators)
        # The twins are one stack: the first critics of all seeds, then the second ones.
        self._critics = self._network(self.observation_size + self.action_size, 1, [*generators, *generators])
        initial = torch.full((len(self.seeds),), log(self.settings.temperature))
        self._log_temperature = TrainedTensor(initial, self.device)
        self._sample_keys = stream_keys(self.seeds, "samples")
        self._num_samples = torch.zeros(1, dtype=torch.int64)
        return {"actor": self._actor, "critics": self._critics}

    def _tensors(self) -> dict[str, Tensor]:
        temperature = {f"temperature/{part}": tensor for part, tensor in self._log_temperature.tensors().items()}
        return super()._tensors() | temperature | {"num_samples": self._num_samples}

    def _part(self, seeds: Sequence[int]) -> dict[str, Tensor]:
        temperature = {f"temperature/{part}": tensor[list(seeds)]
                       for part, tensor in self._log_temperature.tensors().items()}
        return super()._part(seeds) | temperature | {"num_samples": self._num_samples.clone()}

    def _inputs(self, first: int, count: int) -> Iterable[tuple[Any, ...]]:
        numbers, settings = range(first, first + count), self.settings
        rates = [self._adam_rates(rate, numbers) for rate in (
            settings.critic_learning_rate, settings.actor_learning_rate, settings.temperature_learning_rate)]
        noise = normal(self._noise_keys, first, count, (2, settings.batch_size, self.action_size))
        return zip(*rates, torch.from_numpy(noise).to(self.device), strict=True)

    def _update(self, rows: Tensor, critic_rate: Tensor, actor_rate: Tensor, temperature_rate: Tensor,
                noise: Tensor) -> dict[str, Tensor]:
        batch = self._replay.unpack(rows)
        temperature = self._log_temperature.values.exp()
        targets = self._targets(batch, noise[:, 0], temperature)
        losses = self._critics.regress(batch.pairs.repeat(2, 1, 1), targets.repeat(2, 1, 1))
        self._critics.descend(critic_rate)
        actor_loss, log_density = self._actor_gradient(batch, noise[:, 1], temperature)
        self._actor.descend(actor_rate)
        # The loss is -log(temperature) (log-density - A), the entropy wanted being -A.
        self._log_temperature.gradient.copy_(self.action_size - log_density.mean(dim=(1, 2)))
        self._log_temperature.descend(temperature_rate)
        self._critics.follow(self.settings.polyak)
        return {"critic_loss": losses.view(2, -1).sum(dim=0), "actor_loss": actor_loss, "temperature": temperature}

    def _sample(self, observations: Tensor, noise: Tensor) -> Sample:
        outputs, tape = self._actor.network.forward(self._actor.weights, observations)
        mean, log_deviation = outputs.chunk(2, dim=2)
        bounded = log_deviation.clamp(*LOG_DEVIATION)
        deviation = bounded.exp()
        inner = torch.addcmul(mean, deviation, noise)
        # log(1 - tanh(u)^2), without its cancellation for large u.
        squash = 2.0 * (log(2.0) - inner - softplus(-2.0 * inner))
        density = -0.5 * noise.square() - bounded - 0.5 * log(2.0 * pi) - squash
        return Sample(inner.tanh(), density.sum(dim=2, keepdim=True), deviation, bounded == log_deviation, tape)

    def _targets(self, batch: Batch, noise: Tensor, temperature: Tensor) -> Tensor:
        """Return y = r + discount (min_i Q'_i(s', a') - temperature log pi(a'|s')) [S, B, 1], a' drawn anew."""
        sample = self._sample(batch.next_observations, noise)
        next_pairs = torch.cat((batch.next_observations, self._on_box(sample.unit)), dim=2)
        next_values = torch.minimum(*self._critics.target_values(next_pairs.repeat(2, 1, 1)).chunk(2))
        next_values = next_values - temperature[:, None, None] * sample.log_density
        return torch.addcmul(batch.rewards, batch.continues, next_values, value=self.settings.discount)

    def _actor_gradient(self, batch: Batch, noise: Tensor, temperature: Tensor) -> tuple[Tensor, Tensor]:
        """Return the mean over the batch of temperature log pi(a|s) - min_i Q_i(s, a) [S], and the log-densities.

        Its gradient is left in the actor.
        """
        actor, critics = self._actor, self._critics
        weight = temperature[:, None, None]
        sample = self._sample(batch.observations, noise)
        pairs = torch.cat((batch.observations, self._on_box(sample.unit)), dim=2)
        values, tape = critics.network.forward(critics.weights, pairs.repeat(2, 1, 1))
        first, second = values.chunk(2)
        share = 1.0 / first.shape[1]
        slope = torch.cat((torch.where(first <= second, -share, 0.0), torch.where(first <= second, 0.0, -share)))
        slope = torch.add(*critics.network.input_slope(critics.weights, tape, slope).chunk(2))
        slope = slope[..., self.observation_size :] * self._half
        # By u: the critic's slope through the tanh, and that of the density's -log(1 - tanh(u)^2).
        inner = torch.ops.aten.tanh_backward(slope, sample.unit) + 2.0 * share * weight * sample.unit
        by_log_deviation = (inner * noise * sample.deviation - share * weight) * sample.free
        actor.network.backward(actor.weights, sample.tape, torch.cat((inner, by_log_deviation), dim=2), actor.gradient)
        return (weight * sample.log_density - torch.minimum(first, second)).mean(dim=(1, 2)), sample.log_density

    def explore(self, observations: Array) -> Array:
        """Return actions [S, B, A] drawn from the policies."""
        keys, number = self._sample_keys, int(self._num_samples)
        with torch.inference_mode():
            count = observations.shape[1]
            noise = normal(keys, number, count, (self.action_size,)).swapaxes(0, 1)
            sample = self._sample(self._tensor(observations), torch.from_numpy(noise).to(self.device))
            self._num_samples += count
            return to_box(sample.unit.cpu().numpy(), self.action_low, self.action_high)

    def value(self, observations: Array, actions: Array) -> Array:
        """Return what the actor climbs: the smaller of the twins' values [S, B] of actions [S, B, A]."""
        pairs = self._pairs(observations, actions)
        with torch.inference_mode():
            smaller = torch.minimum(*self._critics.values(pairs.repeat(2, 1, 1)).chunk(2))
            return smaller.squeeze(2).double().cpu().numpy()
