"""Proximal policy optimisation (Schulman et al., 2017), for environments in which many states step together.

PPO learns from what its present policy just did, and then drops it: it has no replay buffer, and an interface of its
own beside that of the other agents (`StackedAgent`). The policy is a normal distribution around tanh(actor), in
half-widths of the action box, whose standard deviation does not depend on the observation; actions are cut off at the
box.

Differs from the paper: the learning rate follows the KL divergence of an iteration, as in Rudin et al. (2022, "Learning
to walk in minutes using massively parallel deep reinforcement learning"); actor and critic are apart, each with its own
Adam; the discount of each transition is a number of its own, so that tasks may discount by progress instead of time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import inf, log
from typing import Any, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.counter_rng import normal, stream_keys
from pbcs_ompl.agents.networks import MLP, TrainedNetwork, TrainedScalar, adam_rates, load_tensors
from pbcs_ompl.agents.policy import Policy, to_box
from pbcs_ompl.agents.rollout import Rollout, advantages
from pbcs_ompl.agents.settings import LARGEST, check_types_and_widths
from pbcs_ompl.agents.stacked_agent import NonFiniteData, action_box, policy_of
from pbcs_ompl.agents.update import choose_device, quick_arithmetic
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.options import check_names, check_range
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array

KL_TOLERANCE, RATE_STEP = 1.5, 1.3
"""The learning rate changes by the second factor where the KL divergence is off its target by the first one (ours)."""
FIRST_OUTPUTS = 0.1
"""Factor of the last layer of a new actor, whose first actions are so near the middle of the box (Andrychowicz et al.,
2021)."""


@dataclass(frozen=True)
class PPOSettings:
    """Settings of PPO.

    Attributes:
        hidden: Widths of the hidden layers of actor and critic (ours).
        learning_rate: Of Adam, before the first iteration (Schulman et al. 2017).
        smallest_learning_rate, largest_learning_rate: Its bounds (ours).
        kl_target: The KL divergence that an iteration should cause (ours; 0.01 in Rudin et al. 2022).
        epochs: How often an iteration uses each transition (ours; 10 in Schulman et al. 2017).
        batch_size: Transitions in a mini-batch (ours).
        discount: Of rewards, per transition, times what the rollout says of it (ours).
        trace_decay: Lambda of generalised advantage estimation (Schulman et al. 2017).
        clip: How far the ratio of densities counts (Schulman et al. 2017).
        entropy_weight: Of the policy's entropy against the advantages (ours).
        initial_std, smallest_std: Standard deviation of actions at first and at least, in half-widths of the box
            (ours).

    Raises:
        InvalidOption: a value of the wrong type or out of its range.
    """

    algorithm: ClassVar[str] = "ppo"

    hidden: tuple[int, ...] = (128, 128)
    learning_rate: float = 3e-4
    smallest_learning_rate: float = 5e-5
    largest_learning_rate: float = 2e-3
    kl_target: float = 0.02
    epochs: int = 6
    batch_size: int = 512
    discount: float = 0.995
    trace_decay: float = 0.95
    clip: float = 0.2
    entropy_weight: float = 0.002
    initial_std: float = 0.3
    smallest_std: float = 0.1

    def __post_init__(self) -> None:
        check_types_and_widths(self)
        for name in ("learning_rate", "smallest_learning_rate", "largest_learning_rate", "kl_target", "clip"):
            check_range(name, getattr(self, name), 0.0 < getattr(self, name) < inf, "a positive number")
        for name in ("epochs", "batch_size"):
            check_range(name, getattr(self, name), 1 <= getattr(self, name) <= LARGEST, f"from 1 to {LARGEST}")
        for name in ("discount", "trace_decay"):
            check_range(name, getattr(self, name), 0.0 <= getattr(self, name) <= 1.0, "in [0, 1]")
        check_range("entropy_weight", self.entropy_weight, 0.0 <= self.entropy_weight < inf, "at least 0")
        for name in ("initial_std", "smallest_std"):
            check_range(name, getattr(self, name), 0.0 < getattr(self, name) <= 1.0, "in (0, 1]")

    def to_dict(self) -> dict[str, Any]:
        """Return all settings by name, as numbers and lists that TOML and JSON can hold; see `from_dict`."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the settings with some values; the others keep their defaults.

        Raises:
            InvalidOption: an unknown setting, or a value of the wrong type or out of its range.
        """
        check_names(f"agent {cls.algorithm!r}", "setting", values, [field.name for field in fields(cls)])
        return cls(**values)


@dataclass(frozen=True, eq=False)
class Drawn:
    """Actions that were drawn from policies.

    Attributes:
        actions: In the action box [S, B, A].
        inner: The same in half-widths of the box, before they were cut off at it [S, B, A].
        log_densities: Of `inner` [S, B].
        values: Of the observations, by the critic [S, B].
    """

    actions: Array
    inner: Array
    log_densities: Array
    values: Array


class PPO:
    """S PPO agents as one stack; a stack of S seeds does what S separate agents do.

    Args:
        observation_size: Length O of an observation.
        action_low, action_high: The action box [A], finite.
        settings: None for the defaults.
        seeds: One for each agent.
        device: "cpu" or "cuda".

    Attributes:
        num_updates: Gradient steps so far.
        num_iterations: Rollouts that were trained on so far.
        learning_rates: Those of the next iteration [S].

    Raises:
        InvalidOption: an option out of its range.
        UnsupportedSpace: an action box that is empty or not finite.

    Example:
        >>> agent = PPO(3, [-2.0], [2.0])
        >>> agent.explore(np.zeros((1, 64, 3))).actions.shape
        (1, 64, 1)
    """

    settings_type = PPOSettings

    def __init__(self, observation_size: int, action_low: Any, action_high: Any, *,
                 settings: PPOSettings | None = None, seeds: Sequence[int] = (0,),
                 device: str | torch.device = "cpu"):
        self.settings = settings or PPOSettings()
        self.observation_size = observation_size
        self.action_low, self.action_high = action_box(action_low, action_high)
        self.action_size = len(self.action_low)
        self.seeds = tuple(int(seed) for seed in seeds)
        if not self.seeds or observation_size < 1:
            raise InvalidOption(f"{len(self.seeds)} seeds and {observation_size} observations, expected some")
        self.device = choose_device(device)
        self.num_updates, self.num_iterations, self._num_samples = 0, 0, 0
        self.learning_rates = np.full(len(self.seeds), self.settings.learning_rate)
        self._sample_keys = stream_keys(self.seeds, "samples")
        self._make_networks()

    def _make_networks(self) -> None:
        generators = [SeedTree(seed).child("weights").generator() for seed in self.seeds]
        sizes = (self.observation_size, *self.settings.hidden)
        self.actor = TrainedNetwork(MLP((*sizes, self.action_size)), generators, self.device)
        self.critic = TrainedNetwork(MLP((*sizes, 1)), generators, self.device)
        last = self.actor.weights.layers[-1]
        last.weight.mul_(FIRST_OUTPUTS)
        last.bias.mul_(FIRST_OUTPUTS)
        first = torch.full((len(self.seeds), self.action_size), log(self.settings.initial_std))
        self.log_std = TrainedScalar(first, self.device)

    def act(self, observations: Array) -> Array:
        """Return the actors' actions [S, B, A] for observations [S, B, O], without noise."""
        with torch.inference_mode():
            means = self.actor.weights(self._tensor(observations)).tanh()
        return to_box(means.cpu().numpy(), self.action_low, self.action_high)

    def explore(self, observations: Array) -> Drawn:
        """Draw actions from the policies for observations [S, B, O]."""
        count = observations.shape[1]
        noise = normal(self._sample_keys, self._num_samples, count, (self.action_size,)).swapaxes(0, 1)
        self._num_samples += count
        with torch.inference_mode():
            inputs = self._tensor(observations)
            means = self.actor.weights(inputs).tanh()
            inner = means + self.log_std.values.exp()[:, None] * self._tensor(noise)
            density = losses.normal_log_density(inner, means, self.log_std.values)
            values = self.critic.weights(inputs)[..., 0]
        drawn = inner.cpu().numpy()
        actions = to_box(np.clip(drawn, -1.0, 1.0), self.action_low, self.action_high)
        return Drawn(actions, drawn.astype(np.float64), _plain(density), _plain(values))

    def value(self, observations: Array) -> Array:
        """Return the critics' values [S, B] of observations [S, B, O]: what the policy will gain from there."""
        with torch.inference_mode():
            return _plain(self.critic.weights(self._tensor(observations))[..., 0])

    def policy(self, seed_index: int = 0) -> Policy:
        """Return a copy of one seed's actor that no longer changes."""
        return policy_of(self.actor, seed_index, self.action_low, self.action_high)

    def train(self, rollout: Rollout) -> dict[str, Array]:
        """Make one iteration: some epochs of mini-batches of a rollout of the present policy.

        Args:
            rollout: Of as many seeds; it has at least one mini-batch.

        Returns:
            The means of policy loss and value loss over the last epoch, its KL divergence from the policy of the
            rollout, and the learning rate, [S] each.

        Raises:
            InvalidOption: the rollout is too small, or of other seeds or sizes.
            NonFiniteData: it holds NaN or infinity, or a loss is; the message names it.
        """
        self._check(rollout)
        settings = self.settings
        gains = advantages(rollout, settings.discount, settings.trace_decay)
        flat = self._flattened(rollout, gains)
        rates = [_spread(network.network, self.learning_rates, self.device) for network in (self.actor, self.critic)]
        rates.append(self._tensor(self.learning_rates)[:, None])
        work = len(self.seeds) * settings.batch_size * max(settings.hidden) ** 2
        results: list[tuple[Tensor, ...]] = []
        with quick_arithmetic(work, record=True):
            for epoch in range(settings.epochs):
                results = [self._update(batch, rates) for batch in self._batches(flat, epoch)]
        policy_loss, divergence, value_loss = (_plain(torch.stack(part).mean(0)) for part in zip(*results, strict=True))
        found = {"policy_loss": policy_loss, "value_loss": value_loss, "kl": divergence,
                 "learning_rate": self.learning_rates.copy()}
        for name, values in found.items():
            if not np.isfinite(values).all():
                seed = self.seeds[int(np.argmin(np.isfinite(values)))]
                raise NonFiniteData(f"{name} of seed {seed} is not finite in iteration {self.num_iterations + 1}; try "
                                    "a smaller learning rate or smaller rewards")
        self.num_iterations += 1
        self._adapt(divergence)
        return found

    def _check(self, rollout: Rollout) -> None:
        seeds, length, states, size = rollout.observations.shape
        if (seeds, size) != (len(self.seeds), self.observation_size) or rollout.inner.shape[3] != self.action_size:
            raise InvalidOption(f"a rollout of {seeds} seeds with observations of {size} and actions of "
                                f"{rollout.inner.shape[3]} numbers; expected {len(self.seeds)}, "
                                f"{self.observation_size} and {self.action_size}")
        if length * states < self.settings.batch_size:
            raise InvalidOption(f"a rollout of {length * states} transitions, expected at least batch_size="
                                f"{self.settings.batch_size}")
        for name, values in vars(rollout).items():
            if not np.isfinite(values).all():
                raise NonFiniteData(f"{name} of a rollout hold NaN or infinity, in iteration {self.num_iterations + 1}")

    def _flattened(self, rollout: Rollout, gains: Array) -> tuple[Tensor, ...]:
        """Return observations, inner actions, log densities, advantages and returns, [S, T B, ...] each."""
        scaled = (gains - gains.mean(axis=(1, 2), keepdims=True)) / (gains.std(axis=(1, 2), keepdims=True) + 1e-8)
        parts = (rollout.observations, rollout.inner, rollout.log_densities, scaled, gains + rollout.values)
        return tuple(self._tensor(part.reshape(len(self.seeds), -1, *part.shape[3:])) for part in parts)

    def _batches(self, flat: tuple[Tensor, ...], epoch: int) -> list[tuple[Tensor, ...]]:
        """Return the mini-batches of an epoch, each seed's in an order of its own; what is left over is left out."""
        name = f"{self.num_iterations}/{epoch}"
        count, size = flat[0].shape[1], self.settings.batch_size
        orders = np.stack([SeedTree(seed).child("epochs").child(name).generator().permutation(count)
                           for seed in self.seeds])
        chosen = torch.from_numpy(orders[:, :count // size * size]).to(self.device)
        seeds = torch.arange(len(self.seeds), device=self.device)[:, None]
        batches: tuple[Tensor, ...] = torch.split(chosen, size, dim=1)
        return [tuple(part[seeds, rows] for part in flat) for rows in batches]

    def _update(self, batch: tuple[Tensor, ...], rates: list[Tensor]) -> tuple[Tensor, ...]:
        observations, inner, density, gains, returns = batch
        settings = self.settings
        self.num_updates += 1
        step_size, epsilon = adam_rates(1.0, [self.num_updates], self.device)[0]
        rows = [torch.stack([rate * step_size, epsilon.expand_as(rate)]) for rate in rates]
        log_std = self.log_std.values
        policy_loss, divergence, means = self.actor.autograd(losses.clipped_policy_loss, observations, inner, density,
                                                             gains, log_std, settings.clip)
        self.log_std.autograd(losses.clipped_spread_loss, means, inner, density, gains, settings.clip,
                              settings.entropy_weight)
        value_loss = self.critic.autograd(losses.critic_loss, observations, returns[..., None])
        self.actor.step(rows[0])
        self.critic.step(rows[1])
        self.log_std.step(rows[2])
        log_std.clamp_(log(settings.smallest_std), 0.0)
        return policy_loss, divergence, value_loss

    def _adapt(self, divergence: Array) -> None:
        """Change the learning rates where the KL divergence [S] is far from its target."""
        settings = self.settings
        factors = np.where(divergence > KL_TOLERANCE * settings.kl_target, 1.0 / RATE_STEP,
                           np.where(divergence < settings.kl_target / KL_TOLERANCE, RATE_STEP, 1.0))
        self.learning_rates = np.clip(self.learning_rates * factors, settings.smallest_learning_rate,
                                      settings.largest_learning_rate)

    def state_dict(self) -> dict[str, np.ndarray]:
        """Return everything that training needs to continue bit for bit, as named arrays."""
        counts = np.array([self.num_updates, self.num_iterations, self._num_samples])
        return {**{name: tensor.cpu().numpy().copy() for name, tensor in self._tensors().items()},
                "learning_rates": self.learning_rates.copy(), "counts": counts, "seeds": np.array(self.seeds)}

    def load_state_dict(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from `state_dict()` of an agent with the same settings and seeds.

        Raises:
            Mismatch: the state is of another algorithm, other networks or other seeds.
        """
        load_tensors(self._tensors(), state, ("learning_rates", "counts"), self.seeds)
        self.learning_rates = np.array(state["learning_rates"], dtype=np.float64)
        self.num_updates, self.num_iterations, self._num_samples = (int(count) for count in state["counts"])

    def _tensors(self) -> dict[str, Tensor]:
        trained: dict[str, TrainedNetwork | TrainedScalar] = {
            "actor": self.actor, "critic": self.critic, "log_std": self.log_std}
        return {f"{name}/{part}": tensor for name, one in trained.items() for part, tensor in one.tensors().items()}

    def _tensor(self, values: Any) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values, dtype=np.float32)).to(self.device)


def _plain(values: Tensor) -> Array:
    return values.double().cpu().numpy()


def _spread(network: MLP, values: Array, device: torch.device) -> Tensor:
    """Return a number for each parameter of a stack [S P]: that of its seed, of values [S]."""
    flat = torch.empty(len(values) * network.num_parameters, device=device)
    numbers = torch.from_numpy(values.astype(np.float32)).to(device)[:, None, None]
    for layer in network.split(flat):
        for block in layer.tensors():
            block.copy_(numbers.expand_as(block))
    return flat
