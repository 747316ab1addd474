"""What every algorithm shares: S agents as one stack, their replay, the training loop, saving and loading."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.networks import MLP
from pbcs_ompl.agents.policy import Policy, to_box
from pbcs_ompl.agents.replay import Replay
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.streams import stream_keys
from pbcs_ompl.agents.trained_network import TrainedNetwork, adam_rates
from pbcs_ompl.agents.update import Compile, choose_device, compiled, quick_arithmetic
from pbcs_ompl.core.errors import InvalidOption, Mismatch, PbcsError, UnsupportedSpace
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray

CHUNK_ROWS = 25_600
"""Transitions that are drawn from the replay buffers at a time."""


class NonFiniteData(PbcsError):
    """A NaN or an infinity in a transition or in a loss."""


class StackedAgent(ABC):
    """S independent agents of one algorithm, trained together; axis S comes first everywhere.

    An algorithm is a subclass that says which networks there are, how one update is made, and what its critic
    thinks. The network called "actor" gives the actions: its first A outputs, through a tanh, mapped onto the box.

    Args:
        action_low, action_high: The action box [A], finite.
        settings: An instance of `settings_type`; None for its defaults.
        seeds: One for each agent; a stack of S seeds does what S separate agents do.
        device: "cpu" or "cuda".
        compile: True, False, or "auto" (where it pays).

    Raises:
        InvalidOption: an option out of its range.
        UnsupportedSpace: an action box that is empty or not finite.
    """

    settings_type: ClassVar[type[AgentSettings]]

    def __init__(self, observation_size: int, action_low: Any, action_high: Any, *,
                 settings: AgentSettings | None = None, seeds: Sequence[int] = (0,),
                 device: str | torch.device = "cpu", compile: Compile = "auto"):
        self.settings = settings or self.settings_type()
        self.observation_size = observation_size
        self.action_low, self.action_high = _action_box(action_low, action_high)
        self.action_size = len(self.action_low)
        self.seeds = tuple(int(seed) for seed in seeds)
        if not self.seeds or observation_size < 1:
            raise InvalidOption(f"{len(self.seeds)} seeds and {observation_size} observations, expected some")
        self.device = choose_device(device)
        self.num_updates = 0
        self._compile = compile
        self._half = self._tensor((self.action_high - self.action_low) / 2.0)
        self._centre = self._tensor((self.action_high + self.action_low) / 2.0)
        self._noise_keys = stream_keys(self.seeds, "updates")
        numbers = [SeedTree(seed).child("weights").integer() for seed in self.seeds]
        self._networks = self._make_networks([torch.Generator().manual_seed(number) for number in numbers])
        self._replay = Replay(observation_size, self.action_size, seeds=self.seeds,
                              capacity=self.settings.replay_capacity, device=self.device)
        self._run_update = compiled(self._update, compile, self.device)

    @abstractmethod
    def _make_networks(self, generators: Sequence[torch.Generator]) -> dict[str, TrainedNetwork]:
        """Return the networks by name; one is called "actor"."""

    @abstractmethod
    def _inputs(self, first: int, count: int) -> Iterable[tuple[Any, ...]]:
        """Return what each of the updates number first, first + 1, ... (counted from 1) needs beside its mini-batch."""

    @abstractmethod
    def _update(self, *inputs: Any, **_: Any) -> dict[str, Tensor]:
        """Make one update with mini-batches [S, B, W] and an item of `_inputs`; return the losses [S] by name."""

    @abstractmethod
    def value(self, observations: Array, actions: Array) -> Array:
        """Return the critics' values [S, B] of actions [S, B, A] in observations [S, B, O]."""

    def act(self, observations: Array) -> Array:
        """Return the actors' actions [S, B, A] for observations [S, B, O], without noise."""
        actor = self._networks["actor"]
        with torch.inference_mode():
            outputs = actor.values(self._tensor(observations))[..., : self.action_size]
            return to_box(outputs.tanh().cpu().numpy(), self.action_low, self.action_high)

    def explore(self, observations: Array) -> Array:
        """Return the actions [S, B, A] that the agent itself would try: those of `act`, or drawn from its policy."""
        return self.act(observations)

    def remember(self, observations: Array, actions: Array, rewards: Array, next_observations: Array,
                 terminals: Array | BoolArray, mask: BoolArray | None = None) -> None:
        """Append transitions to the replay buffers.

        Args:
            observations, next_observations: [S, B, O].
            actions: [S, B, A].
            rewards: [S, B].
            terminals: Whether nothing can be gained after the transition [S, B].
            mask: Which transitions count [S, B], when seeds contribute different numbers; None for all.

        Raises:
            InvalidOption: arrays of the wrong shape.
            NonFiniteData: NaN or infinity in one of them.
        """
        batch = np.shape(rewards)
        size = (self.observation_size,)
        fields = {"observations": (observations, size), "actions": (actions, self.action_low.shape),
                  "rewards": (rewards, ()), "next_observations": (next_observations, size),
                  "terminals": (terminals, ())}
        if len(batch) != 2 or batch[0] != len(self.seeds):
            raise InvalidOption(f"rewards have the shape {batch}, expected ({len(self.seeds)}, batch)")
        for name, (values, tail) in fields.items():
            if np.shape(values) != batch + tail:
                raise InvalidOption(f"{name} have the shape {np.shape(values)}, expected {batch + tail}")
            if not np.isfinite(values if mask is None else values[mask]).all():
                raise NonFiniteData(f"{name} hold NaN or infinity, after update {self.num_updates}")
        terminals = np.asarray(terminals, dtype=np.float64)
        self._replay.add(observations, actions, rewards, next_observations, terminals, mask)

    def forget(self) -> None:
        """Empty the replay buffers."""
        self._replay.forget()

    @property
    def replay_sizes(self) -> np.ndarray:
        """Number of transitions in each replay buffer [S]."""
        return self._replay.sizes.copy()

    def train(self, num_updates: int) -> dict[str, np.ndarray]:
        """Make updates with mini-batches from the replay buffers; return the mean losses [S] by name.

        Raises:
            InvalidOption: a replay buffer is empty.
            NonFiniteData: a loss is NaN or infinite; the message names the update.
        """
        if num_updates > 0 and not self._replay.sizes.all():
            seed = self.seeds[int(self._replay.sizes.argmin())]
            raise InvalidOption(f"no transitions to learn from for seed {seed}; call remember first")
        batch_size, seeds = self.settings.batch_size, len(self.seeds)
        chunk = max(1, CHUNK_ROWS // (batch_size * seeds))
        total: dict[str, np.ndarray] = {}
        with quick_arithmetic(seeds * batch_size * max(self.settings.hidden) ** 2):
            for start in range(0, num_updates, chunk):
                for name, losses in self._train_chunk(min(chunk, num_updates - start)).items():
                    total[name] = total.get(name, 0.0) + losses.sum(axis=0)
        return {name: losses / num_updates for name, losses in total.items()}

    def _train_chunk(self, count: int) -> dict[str, np.ndarray]:
        rows = self._replay.sample(count, self.settings.batch_size)
        losses = self._run_updates(rows, self.num_updates + 1)
        for name, values in losses.items():
            if not np.isfinite(values).all():
                update, seed = np.argwhere(~np.isfinite(values))[0]
                raise NonFiniteData(
                    f"{name} of seed {self.seeds[seed]} is {values[update, seed]} in update "
                    f"{self.num_updates + update + 1}; try a smaller learning rate or smaller rewards")
        self.num_updates += count
        return losses

    def _run_updates(self, rows: Tensor, first: int) -> dict[str, np.ndarray]:
        """Make updates number first, first + 1, ... with rows [K, S, B, W]; return losses [K, S] by name."""
        inputs = self._inputs(first, len(rows))
        steps = [self._run_update(batch, *more) for batch, more in zip(rows.unbind(), inputs, strict=True)]
        return {name: torch.stack([step[name] for step in steps]).double().cpu().numpy() for name in steps[0]}

    def policy(self, seed_index: int = 0) -> Policy:
        """Return a copy of one seed's actor that no longer changes."""
        actor = self._networks["actor"]
        layers = []
        for weight, bias, norm in actor.network.split(actor.weights.flat.cpu().clone()):
            vectors = [part[seed_index, 0] for part in (bias, *(norm or ()))]
            layers.append(tuple(part.numpy().copy() for part in (weight[seed_index], *vectors)))
        actions = self.action_size
        layers[-1] = tuple(np.ascontiguousarray(part[..., :actions]) for part in layers[-1])
        return Policy(tuple(layers), self.action_low.copy(), self.action_high.copy())

    def state_dict(self, indices: Sequence[int] | None = None) -> dict[str, np.ndarray]:
        """Return everything that training needs to go on bit for bit, as named arrays.

        Args:
            indices: Which agents of the stack; None for all.
        """
        chosen = range(len(self.seeds)) if indices is None else indices
        state = {name: tensor.cpu().numpy() for name, tensor in self._part(chosen).items()}
        state |= {f"replay/{name}": array for name, array in self._replay.state_dict(chosen).items()}
        return state | {"num_updates": np.array(self.num_updates), "seeds": np.array(self.seeds)[list(chosen)]}

    def load_state_dict(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from `state_dict()` of an agent with the same settings and seeds.

        Raises:
            Mismatch: the state is of another algorithm, other networks or other seeds.
        """
        tensors = self._tensors()
        replay = {key.removeprefix("replay/"): state[key] for key in state if key.startswith("replay/")}
        if not {*tensors, "seeds", "num_updates"} <= set(state) or not self._replay.can_load(replay):
            raise Mismatch("this is not the state of such an agent: networks or transitions are missing")
        if tuple(np.ravel(state["seeds"])) != self.seeds:
            raise Mismatch(f"state of the seeds {np.ravel(state['seeds'])}, expected {self.seeds}")
        for name, tensor in tensors.items():
            if np.shape(state[name]) != tuple(tensor.shape):
                raise Mismatch(f"{name} has {np.size(state[name])} values, expected {tensor.numel()}; "
                               "the state is of an agent with other settings")
        for name, tensor in tensors.items():
            tensor.copy_(torch.from_numpy(np.ascontiguousarray(state[name])))
        self._replay.load_state_dict(replay)
        self.num_updates = int(state["num_updates"])

    def clone(self, indices: Sequence[int] | None = None) -> Self:
        """Return an independent copy of the stack, or of some of its agents, that goes on as they would have."""
        seeds = self.seeds if indices is None else [self.seeds[index] for index in indices]
        copy = type(self)(self.observation_size, self.action_low, self.action_high, settings=self.settings,
                          seeds=seeds, device=self.device, compile=self._compile)
        copy.load_state_dict(self.state_dict(indices))
        return copy

    def _tensors(self) -> dict[str, Tensor]:
        return {f"{name}/{part}": tensor for name, network in self._networks.items()
                for part, tensor in network.tensors().items()}

    def _part(self, seeds: Sequence[int]) -> dict[str, Tensor]:
        """Return copies of `_tensors()` for some seeds, by their places."""
        return {f"{name}/{part}": tensor for name, network in self._networks.items()
                for part, tensor in network.part(seeds, len(self.seeds)).items()}

    def _network(self, inputs: int, outputs: int, generators: Sequence[torch.Generator]) -> TrainedNetwork:
        network = MLP((inputs, *self.settings.hidden, outputs), self.settings.layer_norm)
        return TrainedNetwork(network, generators, self.device)

    def _adam_rates(self, learning_rate: float, numbers: Iterable[int]) -> tuple[Tensor, ...]:
        return adam_rates(learning_rate, numbers, self.device).unbind()

    def _on_box(self, unit: Tensor) -> Tensor:
        """Map values in [-1, 1] onto the action box."""
        return torch.addcmul(self._centre, unit, self._half)

    def _tensor(self, values: Array) -> Tensor:
        return torch.from_numpy(np.asarray(values, dtype=np.float32)).to(self.device)

    def _pairs(self, observations: Array, actions: Array) -> Tensor:
        """Return what a critic is given, [S, B, O + A]."""
        return torch.cat((self._tensor(observations), self._tensor(actions)), dim=2)


def _action_box(low: Any, high: Any) -> tuple[Array, Array]:
    low, high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    if low.ndim != 1 or low.shape != high.shape or not len(low):
        raise UnsupportedSpace(f"action bounds of shapes {low.shape} and {high.shape}, expected (A,) twice")
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
        raise UnsupportedSpace(f"action box from {low} to {high}, expected finite bounds with low < high; "
                               "wrap the environment in gymnasium.wrappers.RescaleAction")
    return low, high
