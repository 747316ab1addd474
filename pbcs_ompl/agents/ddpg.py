"""Deep deterministic policy gradient, [Matheron2020] section 1.2.5, Eqs. 1.2-1.5 (Lillicrap et al., 2015).

Differences: losses are means over the mini-batch, not (half) sums; Adam does not see the factor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numba
import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.ddpg_kernel import Constants, Stack, update_many, update_one
from pbcs_ompl.agents.networks import MLP
from pbcs_ompl.agents.presets import make_settings, preset
from pbcs_ompl.agents.stacked_agent import StackedAgent
from pbcs_ompl.agents.trained_network import TrainedNetwork, adam_rates
from pbcs_ompl.agents.update import Compile
from pbcs_ompl.core.contracts import Array
from pbcs_ompl.core.errors import InvalidOption


@dataclass(frozen=True)
class DDPGSettings:
    """Settings of DDPG; the values are those of the preset "fast".

    Attributes:
        hidden: Widths of the hidden layers of actor and critic.
        layer_norm: Normalise the hidden layers.
        polyak: Share of a target network that stays in each update (1 - tau).
        replay_capacity: Transitions of each seed that are kept.

    Raises:
        InvalidOption: a value out of its range.
    """

    hidden: tuple[int, ...] = (64, 64)
    layer_norm: bool = False
    actor_learning_rate: float = 1e-3
    critic_learning_rate: float = 1e-3
    batch_size: int = 100
    discount: float = 0.9
    polyak: float = 0.995
    replay_capacity: int = 1_000_000

    def __post_init__(self) -> None:
        object.__setattr__(self, "hidden", tuple(self.hidden))
        widths = [isinstance(width, int) and width > 0 for width in self.hidden]
        checks = {"hidden": bool(widths) and all(widths),
                  "actor_learning_rate": self.actor_learning_rate > 0.0,
                  "critic_learning_rate": self.critic_learning_rate > 0.0,
                  "batch_size": self.batch_size >= 1, "replay_capacity": self.replay_capacity >= 1,
                  "discount": 0.0 <= self.discount < 1.0, "polyak": 0.0 <= self.polyak <= 1.0}
        wanted = {"discount": "in [0, 1)", "polyak": "in [0, 1]", "hidden": "positive whole numbers"}
        for name, good in checks.items():
            if not good:
                expected = wanted.get(name, "a positive number")
                raise InvalidOption(f"{name} is {getattr(self, name)}, expected {expected}")

    @classmethod
    def from_preset(cls, name: str, **changes: Any) -> Self:
        """Return the settings of a preset, some of them changed.

        Raises:
            UnknownName: no such preset.
            InvalidOption: no such setting, or a value out of its range.
        """
        return make_settings(cls, preset(name, "ddpg") | changes)


class DDPG(StackedAgent):
    """S DDPG agents as one stack; see `StackedAgent` for the arguments and methods.

    Example:
        >>> agent = DDPG(2, [-1.0], [1.0], seeds=(0, 1))
        >>> agent.act(np.zeros((2, 5, 2))).shape
        (2, 5, 1)
    """

    settings_type = DDPGSettings

    def __init__(self, observation_size: int, action_low: Any, action_high: Any, *,
                 settings: DDPGSettings | None = None, seeds: Sequence[int] = (0,),
                 device: str | torch.device = "cpu", compile: Compile = "auto"):
        self.settings = settings or DDPGSettings()
        super().__init__(observation_size, action_low, action_high, self.settings, seeds, device, compile)

    def _make_networks(self, generators: Sequence[torch.Generator]) -> dict[str, TrainedNetwork]:
        actions, hidden, norm = len(self.action_low), self.settings.hidden, self.settings.layer_norm
        actor = MLP((self.observation_size, *hidden, actions), norm)
        critic = MLP((self.observation_size + actions, *hidden, 1), norm)
        self._actor = TrainedNetwork(actor, generators, self.device)
        self._critic = TrainedNetwork(critic, generators, self.device)
        return {"actor": self._actor, "critic": self._critic}

    def _rates(self, first: int, count: int) -> Tensor:
        rates = (self.settings.actor_learning_rate, self.settings.critic_learning_rate)
        return torch.stack([adam_rates(rate, first, count, self.device) for rate in rates], dim=1)

    def _run_updates(self, rows: Tensor, rates: Tensor) -> dict[str, np.ndarray]:
        """Make the same updates as `_update` by the kernel where there is one: four times faster."""
        if self._compile != "auto" or self.device.type != "cpu" or self.settings.layer_norm:
            return super()._run_updates(rows, rates)
        losses = np.empty((*rows.shape[:2], 2), dtype=np.float32)
        constants = Constants(self._half.numpy(), self._centre.numpy(), np.float32(self.settings.discount),
                              np.float32(1.0 - self.settings.polyak))
        before = numba.get_num_threads()
        threads = min(torch.get_num_threads(), before, len(self.seeds))
        numba.set_num_threads(threads)
        run = update_one if threads == 1 else update_many
        run(rows.numpy(), rates.numpy(), _stack(self._actor, len(self.seeds)),
            _stack(self._critic, len(self.seeds)), constants, losses)
        numba.set_num_threads(before)
        critic_loss, actor_loss = np.moveaxis(losses.astype(np.float64), 2, 0)
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}

    def _update(self, rows: Tensor, rates: Tensor) -> dict[str, Tensor]:
        actor_rate, critic_rate = rates.unbind()
        critic_loss = self._critic_gradient(rows)
        self._critic.descend(critic_rate)
        actor_loss = self._actor_gradient(rows)
        self._actor.descend(actor_rate)
        self._actor.follow(self.settings.polyak)
        self._critic.follow(self.settings.polyak)
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}

    def _critic_gradient(self, rows: Tensor) -> Tensor:
        """Return the mean over the batch of (Q(s, a) - y)^2 (Eq. 1.2); leave its gradient in the critic."""
        batch, critic = self._replay.unpack(rows), self._critic
        outputs, _ = self._actor.network.forward(self._actor.target, batch.next_observations)
        next_actions = torch.addcmul(self._centre, outputs.tanh_(), self._half)
        next_pairs = torch.cat((batch.next_observations, next_actions), dim=2)
        next_values, _ = critic.network.forward(critic.target, next_pairs)
        targets = torch.addcmul(batch.rewards, batch.continues, next_values, value=self.settings.discount)
        values, tape = critic.network.forward(critic.weights, batch.pairs)
        errors = values - targets
        critic.network.backward(critic.weights, tape, errors * (2.0 / errors.shape[1]), critic.gradient)
        return errors.square().mean(dim=(1, 2))

    def _actor_gradient(self, rows: Tensor) -> Tensor:
        """Return the mean over the batch of -Q(s, pi(s)) (Eq. 1.3); leave its gradient in the actor."""
        batch, actor, critic = self._replay.unpack(rows), self._actor, self._critic
        outputs, actor_tape = actor.network.forward(actor.weights, batch.observations)
        unit = outputs.tanh()
        pairs = torch.cat((batch.observations, torch.addcmul(self._centre, unit, self._half)), dim=2)
        values, tape = critic.network.forward(critic.weights, pairs)
        # Eq. 1.5: the critic's slope along the actions, handed down through the actor.
        slope = torch.full_like(values, -1.0 / values.shape[1])
        slope = critic.network.input_slope(critic.weights, tape, slope)
        slope = torch.ops.aten.tanh_backward(slope[..., self.observation_size :] * self._half, unit)
        actor.network.backward(actor.weights, actor_tape, slope, actor.gradient)
        return -values.mean(dim=(1, 2))

    def value(self, observations: Array, actions: Array) -> Array:
        """Return the critics' values [S, B] of actions [S, B, A] in observations [S, B, O]."""
        pairs = torch.cat((self._tensor(observations), self._tensor(actions)), dim=2)
        with torch.inference_mode():
            values, _ = self._critic.network.forward(self._critic.weights, pairs)
            return values.squeeze(2).double().cpu().numpy()


def _stack(network: TrainedNetwork, seeds: int) -> Stack:
    arrays = (tensor.numpy() for tensor in network.tensors().values())
    return Stack(network.network.sizes, seeds, *arrays)
