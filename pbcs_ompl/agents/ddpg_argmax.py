"""DDPG-argmax, [Matheron2020] section 6.6.2: DDPG whose actor is regressed towards the best of some random actions.

The critic is that of DDPG (Eq. 1.2), and still learns from the target actor; the policy gradient (Eq. 1.5) is replaced:

    b_j uniform in the action box, for j < N
    c_i = the b_j with the largest Q(s_i, b_j)
    minimise sum_i (pi(s_i) - c_i)^2

Differs: the loss is a mean over the mini-batch, and distances are measured in half-widths of the box, so that all
dimensions of an action weigh the same.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.streams import uniform
from pbcs_ompl.agents.trained_network import TrainedNetwork
from pbcs_ompl.core.types import Array


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
        self._require("candidates", self.candidates >= 1, "at least 1")


class DDPGArgmax(StackedAgent):
    """S DDPG-argmax agents as one stack; see `StackedAgent` for the arguments and methods."""

    settings_type = DDPGArgmaxSettings
    settings: DDPGArgmaxSettings

    def _make_networks(self, generators: Sequence[torch.Generator]) -> dict[str, TrainedNetwork]:
        self._actor = self._network(self.observation_size, self.action_size, generators)
        self._critic = self._network(self.observation_size + self.action_size, 1, generators)
        return {"actor": self._actor, "critic": self._critic}

    def _inputs(self, first: int, count: int) -> Iterable[tuple[Any, ...]]:
        numbers, settings = range(first, first + count), self.settings
        rates = [self._adam_rates(rate, numbers)
                 for rate in (settings.critic_learning_rate, settings.actor_learning_rate)]
        drawn = uniform(self._noise_keys, first, count, (settings.candidates, self.action_size))
        return zip(*rates, torch.from_numpy(2.0 * drawn - 1.0).to(self.device), strict=True)

    def _update(self, rows: Tensor, critic_rate: Tensor, actor_rate: Tensor, candidates: Tensor) -> dict[str, Tensor]:
        batch = self._replay.unpack(rows)
        critic_loss = self._critic.regress(batch.pairs, self._targets(batch))
        self._critic.descend(critic_rate)
        actor_loss = self._actor_gradient(batch, candidates)
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

    def _best(self, observations: Tensor, candidates: Tensor) -> Tensor:
        """Return, for each observation [S, B, O], the candidate [S, N, A] that the critic likes best [S, B, A]."""
        seeds, batch, _ = observations.shape
        count = candidates.shape[1]
        every = torch.cat((observations.repeat_interleave(count, dim=1),
                           self._on_box(candidates).repeat(1, batch, 1)), dim=2)
        choice = self._critic.values(every).view(seeds, batch, count).argmax(dim=2)
        return candidates.gather(1, choice[:, :, None].expand(-1, -1, candidates.shape[2]))

    def _actor_gradient(self, batch: Batch, candidates: Tensor) -> Tensor:
        """Return the mean over the batch of (pi(s) - c)^2 [S]; leave its gradient in the actor."""
        best = self._best(batch.observations, candidates)
        outputs, tape = self._actor.network.forward(self._actor.weights, batch.observations)
        unit = outputs.tanh()
        errors = unit - best
        slope = torch.ops.aten.tanh_backward(errors * (2.0 / errors.shape[1]), unit)
        self._actor.network.backward(self._actor.weights, tape, slope, self._actor.gradient)
        return errors.square().sum(dim=2).mean(dim=1)

    def value(self, observations: Array, actions: Array) -> Array:
        """Return the critics' values [S, B] of actions [S, B, A] in observations [S, B, O]."""
        with torch.inference_mode():
            return self._critic.values(self._pairs(observations, actions)).squeeze(2).double().cpu().numpy()
