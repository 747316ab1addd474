"""What every algorithm shares: S agents as one stack, their replay, the training loop, saving and loading.

An algorithm is a subclass with one method, `update`, which minimises a loss for each of its networks:

    class Mine(StackedAgent):
        settings_type = MySettings

        def update(self, batch, critic_rate, actor_rate):
            targets, critic = self.td_targets(batch), self.critic.weights
            critic_loss = self.minimise(self.critic, critic_rate, my_loss, batch.obs_actions, targets)
            actor_loss = self.minimise(self.actor, actor_rate, policy_loss, critic, batch.observations, self.box)
            self.update_targets()
            return {"critic_loss": critic_loss, "actor_loss": actor_loss}

    def my_loss(critic, obs_actions, targets):                  # [S], differentiated by autograd
        return huber_loss(critic(obs_actions), targets, reduction="none").mean(dim=(1, 2))
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.inputs import INPUT_KINDS, PlainInputs
from pbcs_ompl.agents.kernels.actor_critic import Constants
from pbcs_ompl.agents.kernels.counter_rng import stream_keys
from pbcs_ompl.agents.kernels.updates import Kernel, run
from pbcs_ompl.agents.losses import ActionBox, td_targets
from pbcs_ompl.agents.networks import MLP, Loss, TrainedNetwork, TrainedScalar, adam_rates, load_tensors
from pbcs_ompl.agents.policy import Policy, to_box
from pbcs_ompl.agents.replay import Batch, Replay
from pbcs_ompl.agents.settings import AgentSettings
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

    Args:
        observation_size: Length O of an observation.
        action_low, action_high: The action box [A], finite.
        settings: An instance of `settings_type`; None for its defaults.
        seeds: One for each agent; a stack of S seeds does what S separate agents do.
        device: "cpu" or "cuda".
        compile: True, False, or "auto" (where it pays).

    Attributes:
        settings_type: The class of the settings.
        gradients: Hand-written gradients of some losses, such as `kernels.gradients.GRADIENTS`; none for autograd.
        kernel: The updates as a compiled kernel for a CPU, if the algorithm has one.
        outputs_per_action: Outputs of the actor for each action; its first A, through a tanh, are the action.
        actor, critic: The networks.
        replay: The replay buffers.
        inputs: How the networks take observations and actions.
        box: The actions that the networks take, for losses.
        stream_keys: Keys [S] of the random numbers of updates, for `kernels.counter_rng`.

    Raises:
        InvalidOption: an option out of its range.
        UnsupportedSpace: an action box that is empty or not finite.
    """

    settings_type: ClassVar[type[AgentSettings]]
    gradients: ClassVar[Mapping[Loss, Callable[..., Any]]] = {}
    kernel: ClassVar[Kernel | None] = None
    outputs_per_action: ClassVar[int] = 1

    def __init_subclass__(cls) -> None:
        """Let no kernel stand for an `update` that it was not written for."""
        super().__init_subclass__()
        if "update" in vars(cls) and "kernel" not in vars(cls):
            cls.kernel = None

    def __init__(self, observation_size: int, action_low: Any, action_high: Any, *,
                 settings: AgentSettings | None = None, seeds: Sequence[int] = (0,),
                 device: str | torch.device = "cpu", compile: Compile = "auto"):
        self.settings = settings or self.settings_type()
        self.observation_size = observation_size
        self.action_low, self.action_high = action_box(action_low, action_high)
        self.action_size = len(self.action_low)
        self.seeds = tuple(int(seed) for seed in seeds)
        if not self.seeds or observation_size < 1:
            raise InvalidOption(f"{len(self.seeds)} seeds and {observation_size} observations, expected some")
        self.device = choose_device(device)
        self.compile: Compile = compile
        self.num_updates = 0
        box = ActionBox(self.tensor((self.action_high - self.action_low) / 2.0),
                        self.tensor((self.action_high + self.action_low) / 2.0))
        self.inputs = INPUT_KINDS[self.settings.inputs](len(self.seeds), observation_size, box)
        self.box = self.inputs.box
        self.stream_keys = stream_keys(self.seeds, "updates")
        self._trained = self.make_networks([SeedTree(seed).child("weights").generator() for seed in self.seeds])
        self.replay = Replay(observation_size, self.action_size, seeds=self.seeds,
                             capacity=self.settings.replay_capacity, device=self.device)
        self._run_update = compiled(self._update_rows, compile, self.device, record=not self.gradients)

    def make_networks(self, generators: Sequence[np.random.Generator]) -> dict[str, TrainedNetwork | TrainedScalar]:
        """Return all that is trained, by name; an algorithm that trains more than actor and critic adds to it."""
        hidden, norm, law = self.settings.hidden, self.settings.layer_norm, self.settings.initialisation
        late = self.action_size if self.inputs.late_actions else 0
        actor = MLP((self.observation_size, *hidden, self.outputs_per_action * self.action_size), norm)
        critic = MLP((self.observation_size + self.action_size, *hidden, 1), norm, late)
        self.actor = TrainedNetwork(actor, generators, self.device, law)
        self.critic = TrainedNetwork(critic, list(generators) * self.num_critics, self.device, law)
        return {"actor": self.actor, "critic": self.critic}

    @property
    def num_critics(self) -> int:
        """Critics of each seed. They are one stack: the first ones of all seeds, then the second ones."""
        return 1

    @abstractmethod
    def update(self, *arguments: Any, **_: Any) -> dict[str, Tensor]:
        """Make one update of all networks: update(batch, critic_rate, actor_rate, ...).

        Args:
            arguments: A `Batch` [S, B, ...], then an item of each sequence of `update_inputs`, the first ones of which
                are the rates of this step of Adam.

        Returns:
            The losses [S] by name.
        """

    def update_inputs(self, first: int, count: int) -> tuple[Sequence[Any] | Tensor, ...]:
        """Return the arguments of `update` after the mini-batch, for updates number first, first + 1, ... (from 1).

        Each is a sequence (or tensor) of `count` items, one for each update. An algorithm that needs random numbers
        draws them here, for many updates at once.
        """
        return self.adam_rates(first, count)

    def adam_rates(self, first: int, count: int) -> tuple[Tensor, Tensor]:
        """Return the rates of the critic's and the actor's steps number first, first + 1, ..., [count, 2] each."""
        numbers = range(first, first + count)
        return (self.rates_of(self.settings.critic_learning_rate, numbers),
                self.rates_of(self.settings.actor_learning_rate, numbers))

    def rates_of(self, learning_rate: float, numbers: Iterable[int]) -> Tensor:
        """Return the rates [K, 2] of K steps of Adam by their numbers, counted from 1."""
        return adam_rates(learning_rate, numbers, self.device)

    def minimise(self, trained: TrainedNetwork | TrainedScalar, rate: Tensor, loss: Loss, *arguments: Any) -> Any:
        """Make one step of Adam against the gradient of a loss.

        The gradient comes from autograd, or from `gradients` if the loss is listed there.

        Args:
            trained: What is changed; the loss is given its weights (or values) first.
            rate: Of this step; see `update`.
            loss: Returns losses [S], or a tuple that begins with them.
            arguments: Of the loss, after the weights.

        Returns:
            What the loss returned, without its graph.

        Raises:
            InvalidOption: the algorithm has hand-written gradients, but none for this loss.
        """
        by_hand = self.gradients.get(loss)
        if by_hand is not None:
            outcome = by_hand(trained, *arguments)
        elif self.gradients:
            raise InvalidOption(f"{type(self).__name__}.gradients has no gradient of the loss {loss.__name__!r}; "
                                "set gradients = {} to leave all of them to autograd")
        else:
            outcome = trained.autograd(loss, *arguments)
        trained.step(rate)
        return outcome

    def td_targets(self, batch: Batch) -> Tensor:
        """Return y = r + discount Q'(s', pi'(s')) [S, B, 1], or r at the end of an episode: those of DDPG."""
        squashed = self.actor.target(batch.next_observations).tanh_()
        next_values = self.critic.target(self.box.join(batch.next_observations, squashed))
        return td_targets(batch.rewards, batch.not_done, next_values, self.settings.discount)

    def update_targets(self) -> None:
        """Make a Polyak update of the target networks of actor and critic."""
        self.actor.update_target(self.settings.polyak)
        self.critic.update_target(self.settings.polyak)

    def value(self, observations: Array, actions: Array) -> Array:
        """Return the first critics' values [S, B] of actions [S, B, A] in observations [S, B, O]."""
        return self.critic_values(observations, actions)[: len(self.seeds)]

    def critic_values(self, observations: Array, actions: Array) -> Array:
        """Return the values [C S, B] of all C critics of each seed, the first ones of all seeds first."""
        inputs = torch.cat((self.observed(observations), self.inputs.actions(self.tensor(actions))), dim=2)
        with torch.inference_mode():
            values = self.critic.weights(inputs.repeat(self.num_critics, 1, 1))
            return values.squeeze(2).double().cpu().numpy()

    def act(self, observations: Array) -> Array:
        """Return the actors' actions [S, B, A] for observations [S, B, O], without noise."""
        with torch.inference_mode():
            outputs = self.actor.weights(self.observed(observations))[..., : self.action_size]
            return to_box(outputs.tanh().cpu().numpy(), self.action_low, self.action_high)

    def explore(self, observations: Array) -> Array:
        """Return the actions [S, B, A] of a stochastic policy; those of `act` where the policy is deterministic."""
        return self.act(observations)

    def add_transitions(self, observations: Array, actions: Array, rewards: Array, next_observations: Array,
                 terminals: Array | BoolArray, mask: BoolArray | None = None) -> None:
        """Append transitions to the replay buffers.

        Args:
            observations, next_observations: [S, B, O].
            actions: [S, B, A].
            rewards: [S, B].
            terminals: Whether the episode ended with the transition, other than by a limit of steps [S, B].
            mask: Which transitions are added [S, B], when seeds contribute different numbers; None for all.

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
        self.inputs.add(observations, mask)
        self.replay.add(observations, actions, rewards, next_observations, terminals, mask)

    def clear_replay(self) -> None:
        """Empty the replay buffers."""
        self.replay.clear()

    @property
    def replay_sizes(self) -> np.ndarray:
        """Number of transitions in each replay buffer [S]."""
        return self.replay.sizes.copy()

    def train(self, num_updates: int) -> dict[str, np.ndarray]:
        """Make updates with mini-batches from the replay buffers; return the mean losses [S] by name.

        Raises:
            InvalidOption: a replay buffer is empty.
            NonFiniteData: a loss is NaN or infinite; the message names the update.
        """
        if num_updates > 0 and not self.replay.sizes.all():
            seed = self.seeds[int(self.replay.sizes.argmin())]
            raise InvalidOption(f"no transitions to learn from for seed {seed}; call add_transitions first")
        batch_size, seeds = self.settings.batch_size, len(self.seeds)
        chunk = max(1, CHUNK_ROWS // (batch_size * seeds))
        total: dict[str, np.ndarray] = {}
        work = seeds * batch_size * max(self.settings.hidden) ** 2
        with quick_arithmetic(work, record=not self.gradients):
            for start in range(0, num_updates, chunk):
                for name, losses in self._train_chunk(min(chunk, num_updates - start)).items():
                    total[name] = total.get(name, 0.0) + losses.sum(axis=0)
        return {name: losses / num_updates for name, losses in total.items()}

    def _train_chunk(self, count: int) -> dict[str, np.ndarray]:
        rows = self.inputs.rows(self.replay.sample(count, self.settings.batch_size))
        losses = self.run_updates(rows, self.num_updates + 1)
        for name, values in losses.items():
            if not np.isfinite(values).all():
                update, seed = np.argwhere(~np.isfinite(values))[0]
                raise NonFiniteData(
                    f"{name} of seed {self.seeds[seed]} is {values[update, seed]} in update "
                    f"{self.num_updates + update + 1}; try a smaller learning rate or smaller rewards")
        self.num_updates += count
        return losses

    def run_updates(self, rows: Tensor, first: int) -> dict[str, np.ndarray]:
        """Make updates number first, first + 1, ... with rows [K, S, B, W]; return losses [K, S] by name."""
        inputs = self.update_inputs(first, len(rows))
        if self.kernel is not None and self._kernel_serves():
            constants = Constants(self.box.half.numpy(), self.box.centre.numpy(), np.float32(self.settings.discount),
                                  np.float32(1.0 - self.settings.polyak))
            return run(self.kernel, rows, inputs, list(self._trained.values()), constants)
        steps = [self._run_update(*step) for step in zip(rows.unbind(), *inputs, strict=True)]
        return {name: torch.stack([step[name] for step in steps]).double().cpu().numpy() for name in steps[0]}

    def _kernel_serves(self) -> bool:
        """Whether updates may be made by the kernel: on a CPU, unless another way was asked for."""
        plain = bool(self.gradients) and not self.inputs.late_actions
        return self.compile == "auto" and self.device.type == "cpu" and plain

    def _update_rows(self, rows: Tensor, *inputs: Any) -> dict[str, Tensor]:
        return self.update(self.replay.unpack(rows), *inputs)

    def policy(self, seed_index: int = 0) -> Policy:
        """Return a copy of one seed's actor that no longer changes."""
        return policy_of(self.actor, seed_index, self.action_low, self.action_high, self.inputs)

    def state_dict(self, indices: Sequence[int] | None = None) -> dict[str, np.ndarray]:
        """Return everything that training needs to continue bit for bit, as named arrays.

        Args:
            indices: Which agents of the stack; None for all.
        """
        chosen = range(len(self.seeds)) if indices is None else indices
        state = {name: tensor.cpu().numpy() for name, tensor in self.part(chosen).items()}
        state |= {f"replay/{name}": array for name, array in self.replay.state_dict(chosen).items()}
        state |= {f"inputs/{name}": array for name, array in self.inputs.state_dict(chosen).items()}
        return state | {"num_updates": np.array(self.num_updates), "seeds": np.array(self.seeds)[list(chosen)]}

    def load_state_dict(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from `state_dict()` of an agent with the same settings and seeds.

        Raises:
            Mismatch: the state is of another algorithm, other networks or other seeds.
        """
        replay = {key.removeprefix("replay/"): state[key] for key in state if key.startswith("replay/")}
        inputs = {key.removeprefix("inputs/"): state[key] for key in state if key.startswith("inputs/")}
        if not (self.replay.can_load(replay) and set(inputs) == set(self.inputs.state_dict(range(len(self.seeds))))):
            raise Mismatch("this is not the state of such an agent: transitions are missing")
        load_tensors(self.tensors(), state, ("num_updates",), self.seeds)
        self.replay.load_state_dict(replay)
        self.inputs.load_state_dict(inputs)
        self.num_updates = int(state["num_updates"])

    def clone(self, indices: Sequence[int] | None = None) -> Self:
        """Return an independent copy of the stack, or of some of its agents, that trains as they would have."""
        seeds = self.seeds if indices is None else [self.seeds[index] for index in indices]
        copy = type(self)(self.observation_size, self.action_low, self.action_high, settings=self.settings,
                          seeds=seeds, device=self.device, compile=self.compile)
        copy.load_state_dict(self.state_dict(indices))
        return copy

    def tensors(self) -> dict[str, Tensor]:
        """Return all that is saved of the networks, by name."""
        return {f"{name}/{part}": tensor for name, trained in self._trained.items()
                for part, tensor in trained.tensors().items()}

    def part(self, seeds: Sequence[int]) -> dict[str, Tensor]:
        """Return copies of `tensors()` for some seeds, by their indices."""
        return {f"{name}/{part}": tensor for name, trained in self._trained.items()
                for part, tensor in trained.part(seeds, len(self.seeds)).items()}

    def observed(self, observations: Array) -> Tensor:
        """Return observations [S, B, O] as the networks take them."""
        return self.inputs.observations(self.tensor(observations))

    def tensor(self, values: Array) -> Tensor:
        """Return an array as float32 on the agent's device."""
        return torch.from_numpy(np.asarray(values, dtype=np.float32)).to(self.device)


def policy_of(actor: TrainedNetwork, seed_index: int, low: Array, high: Array,
              inputs: PlainInputs | None = None) -> Policy:
    """Return a copy of one actor of a stack that no longer changes.

    Args:
        actor: Its first A outputs, through a tanh, are the action.
        seed_index: Which one.
        low, high: The action box [A].
        inputs: How it takes observations; None for as they are.
    """
    layers: list[tuple[np.ndarray, ...]] = []
    for weight, *vectors in (layer.tensors() for layer in actor.weights.layers):
        parts = (weight[seed_index], *(vector[seed_index, 0] for vector in vectors))
        layers.append(tuple(part.cpu().numpy().copy() for part in parts))
    if inputs is not None:
        layers[0] = (*inputs.raw_layer(layers[0][0], layers[0][1], seed_index), *layers[0][2:])
    layers[-1] = tuple(np.ascontiguousarray(part[..., :len(low)]) for part in layers[-1])
    return Policy(tuple(layers), low.copy(), high.copy())


def action_box(low: Any, high: Any) -> tuple[Array, Array]:
    """Return the bounds of actions [A] as arrays.

    Raises:
        UnsupportedSpace: the box is empty or not finite.
    """
    low, high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    if low.ndim != 1 or low.shape != high.shape or not len(low):
        raise UnsupportedSpace(f"action bounds of shapes {low.shape} and {high.shape}, expected (A,) twice")
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
        raise UnsupportedSpace(f"action box from {low} to {high}, expected finite bounds with low < high; "
                               "wrap the environment in gymnasium.wrappers.RescaleAction")
    return low, high
