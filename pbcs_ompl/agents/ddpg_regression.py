"""DDPG with the regression update of the actor, [Matheron2020] Eq. 6.5 (as in CACLA, van Hasselt and Wiering, 2007).

The critic is that of DDPG (Eq. 1.2) with its targets y. Where a transition did better than the actor was thought to do,
the actor is pulled towards its action; elsewhere it is left alone:

    L = sum_i [y_i > Q(s_i, pi(s_i))] (pi(s_i) - a_i)^2

Differs: Eq. 6.5 lacks the square, without which it has no minimum. The loss is a mean over the whole mini-batch, and
distances are measured in half-widths of the action box. Actor and critic learn from the same weights, "simultaneously".
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.trained_network import TrainedNetwork
from pbcs_ompl.core.types import Array


@dataclass(frozen=True)
class DDPGRegressionSettings(AgentSettings):
    """Settings of DDPG with the regression update: those that every algorithm has."""

    algorithm = "ddpg-regression"


class DDPGRegression(StackedAgent):
    """S such agents as one stack; see `StackedAgent` for the arguments and methods."""

    settings_type = DDPGRegressionSettings
    settings: DDPGRegressionSettings

    def _make_networks(self, generators: Sequence[torch.Generator]) -> dict[str, TrainedNetwork]:
        self._actor = self._network(self.observation_size, self.action_size, generators)
        self._critic = self._network(self.observation_size + self.action_size, 1, generators)
        return {"actor": self._actor, "critic": self._critic}

    def _inputs(self, first: int, count: int) -> Iterable[tuple[Any, ...]]:
        numbers, settings = range(first, first + count), self.settings
        return zip(self._adam_rates(settings.critic_learning_rate, numbers),
                   self._adam_rates(settings.actor_learning_rate, numbers), strict=True)

    def _update(self, rows: Tensor, critic_rate: Tensor, actor_rate: Tensor) -> dict[str, Tensor]:
        batch = self._replay.unpack(rows)
        targets = self._targets(batch)
        actor_loss = self._actor_gradient(batch, targets)
        critic_loss = self._critic.regress(batch.pairs, targets)
        self._critic.descend(critic_rate)
        self._actor.descend(actor_rate)
        self._actor.follow(self.settings.polyak)
        self._critic.follow(self.settings.polyak)
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}

    def _targets(self, batch: Batch) -> Tensor:
        """Return y = r + discount Q'(s', pi'(s')) [S, B, 1], terminal transitions aside (Eq. 1.2)."""
        unit = self._actor.target_values(batch.next_observations).tanh_()
        next_pairs = torch.cat((batch.next_observations, self._on_box(unit)), dim=2)
        next_values = self._critic.target_values(next_pairs)
        return torch.addcmul(batch.rewards, batch.continues, next_values, value=self.settings.discount)

    def _actor_gradient(self, batch: Batch, targets: Tensor) -> Tensor:
        """Return the mean over the batch of [y > Q(s, pi(s))] (pi(s) - a)^2 [S]; leave its gradient in the actor."""
        outputs, tape = self._actor.network.forward(self._actor.weights, batch.observations)
        unit = outputs.tanh()
        expected = self._critic.values(torch.cat((batch.observations, self._on_box(unit)), dim=2))
        taken = (batch.pairs[..., self.observation_size :] - self._centre) / self._half
        errors = (unit - taken) * (targets > expected)
        slope = torch.ops.aten.tanh_backward(errors * (2.0 / errors.shape[1]), unit)
        self._actor.network.backward(self._actor.weights, tape, slope, self._actor.gradient)
        return errors.square().sum(dim=2).mean(dim=1)

    def value(self, observations: Array, actions: Array) -> Array:
        """Return the critics' values [S, B] of actions [S, B, A] in observations [S, B, O]."""
        with torch.inference_mode():
            return self._critic.values(self._pairs(observations, actions)).squeeze(2).double().cpu().numpy()
