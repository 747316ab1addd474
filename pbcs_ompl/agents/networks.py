"""Multi-layer perceptrons stacked over seeds, and their training: targets, Adam, gradients by autograd.

All parameters of a stack lie in one buffer, so that an optimiser step or a Polyak update is a few flat operations; the
layers are views of it. A loss takes a `Weights`, which is called as a function of inputs, and returns one number for
each network of the stack.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.initialisation import INITIALISATIONS, draw_layer, layer_shapes
from pbcs_ompl.agents.kernels.layer_norm import LAYER_NORM_EPSILON
from pbcs_ompl.agents.kernels.network import BETA_1, BETA_2
from pbcs_ompl.core.errors import Mismatch

ADAM_EPSILON = 1e-8
"""Of Adam (Kingma and Ba, 2015), as are the two decay rates of its moments."""

Loss = Callable[..., Any]
"""Losses [S] of a stack, or a tuple that begins with them, as a function of its `Weights` and more arguments."""


class Norm(NamedTuple):
    """Parameters of one layer norm, both [S, 1, out]."""

    gain: Tensor
    shift: Tensor


class Layer(NamedTuple):
    """Parameters of one layer."""

    weight: Tensor
    """[S, in, out]"""
    bias: Tensor
    """[S, 1, out]"""
    norm: Norm | None

    def tensors(self) -> list[Tensor]:
        """Return all parameters: weight, bias, and gain and shift where there are some."""
        return [self.weight, self.bias, *(self.norm or ())]

    def map(self, change: Callable[[Tensor], Tensor]) -> "Layer":
        """Return a layer of changed parameters."""
        norm = None if self.norm is None else Norm(change(self.norm.gain), change(self.norm.shift))
        return Layer(change(self.weight), change(self.bias), norm)


@dataclass(frozen=True)
class MLP:
    """The shape of a ReLU network with a linear output layer; its parameters are kept apart, in `Weights`.

    Args:
        sizes: Width of the input, of every hidden layer, and of the output.
        layer_norm: Normalise every hidden layer before its ReLU, with learnt gain and shift.
        late_inputs: How many of the last inputs skip the first layer and join its values.
    """

    sizes: tuple[int, ...]
    layer_norm: bool = False
    late_inputs: int = 0

    @property
    def num_parameters(self) -> int:
        """Number P of parameters of one seed."""
        norm = 2 * sum(self.sizes[1:-1]) if self.layer_norm else 0
        return norm + sum((before + 1) * after for before, after in layer_shapes(self.sizes, self.late_inputs))

    def split(self, flat: Tensor) -> list[Layer]:
        """Return the layers of a buffer [S * P] as views: one contiguous block for each parameter."""
        seeds, start, layers = flat.shape[0] // self.num_parameters, 0, []

        def take(rows: int, width: int) -> Tensor:
            nonlocal start
            start += seeds * rows * width
            return flat[start - seeds * rows * width : start].view(seeds, rows, width)

        for index, (before, after) in enumerate(layer_shapes(self.sizes, self.late_inputs)):
            normed = self.layer_norm and index < len(self.sizes) - 2
            layers.append(Layer(take(before, after), take(1, after),
                                Norm(take(1, after), take(1, after)) if normed else None))
        return layers

    def divide(self, inputs: Tensor) -> tuple[Tensor, Tensor | None]:
        """Return the inputs of the first layer, and those that join its values, if any."""
        first = inputs.shape[-1] - self.late_inputs
        return (inputs[..., :first], inputs[..., first:]) if self.late_inputs else (inputs, None)

    def select(self, flat: Tensor, members: Sequence[int]) -> Tensor:
        """Return a copy of the buffer of some networks of a stack, by their indices."""
        chosen = torch.tensor(members, device=flat.device)
        return torch.cat([block[chosen].flatten() for layer in self.split(flat) for block in layer.tensors()])

    def initial(self, generators: Sequence[np.random.Generator], initialisation: str = "torch") -> Tensor:
        """Draw parameters [S * P], each seed's from its own generator, from a law of `INITIALISATIONS`."""
        flat = torch.empty(len(generators) * self.num_parameters)
        layers = self.split(flat)
        for index, layer in enumerate(layers):
            fan_in, fan_out = layer.weight.shape[1:]
            bounds = INITIALISATIONS[initialisation](fan_in, fan_out, index == len(layers) - 1)
            for weight, bias, generator in zip(layer.weight, layer.bias, generators, strict=True):
                drawn = draw_layer(bounds, fan_in, fan_out, generator)
                weight.copy_(torch.from_numpy(drawn[0]))
                bias.copy_(torch.from_numpy(drawn[1]))
            if layer.norm is not None:
                layer.norm.gain.fill_(1.0)
                layer.norm.shift.zero_()
        return flat


class Weights:
    """The parameters of a stack: a buffer and its layers, which are views of it. Called, it is the network.

    Args:
        network: The shape of the networks.
        flat: The buffer [S * P].
        layers: Other tensors than the views of the buffer, such as leaves of autograd.
    """

    def __init__(self, network: MLP, flat: Tensor, layers: list[Layer] | None = None):
        self.network, self.flat = network, flat
        self._given = layers is not None
        self._layers = network.split(flat) if layers is None else layers

    @property
    def layers(self) -> list[Layer]:
        """The layers, from the inputs to the outputs."""
        # A compiler must see that the views alias the buffer; eager code saves the time of making them.
        return self.network.split(self.flat) if torch.compiler.is_compiling() and not self._given else self._layers

    def first(self, count: int) -> "Weights":
        """Return the first `count` networks of the stack, as views."""
        return Weights(self.network, self.flat, [layer.map(lambda block: block[:count]) for layer in self.layers])

    def __call__(self, inputs: Tensor) -> Tensor:
        """Return the outputs [S, B, out] for inputs [S, B, in]."""
        *hidden, last = self.layers
        values, late = self.network.divide(inputs)
        for index, (weight, bias, norm) in enumerate(hidden):
            values = torch.baddbmm(bias, values, weight)
            if norm is not None:
                normal, _, _ = torch.native_layer_norm(values, values.shape[-1:], None, None, LAYER_NORM_EPSILON)
                values = torch.addcmul(norm.shift, normal, norm.gain)
            values = values.relu_()
            if index == 0 and late is not None:
                values = torch.cat((values, late), dim=2)
        return torch.baddbmm(last.bias, values, last.weight)


class TrainedNetwork:
    """A stack of networks of one shape, trained by Adam, with target networks that follow slowly.

    Attributes:
        weights: The networks.
        target: Their targets.
        gradient: Where `autograd`, or a kernel in its place, leaves the gradient of a loss.
        mean, square: Adam's moments [S * P].

    Args:
        network: The shape of the networks.
        generators: One for each network.
        device: Where they lie.
        initialisation: From which law their parameters are drawn.
    """

    def __init__(self, network: MLP, generators: Sequence[np.random.Generator], device: torch.device,
                 initialisation: str = "torch"):
        self.network = network
        initial = network.initial(generators, initialisation).to(device)
        self.weights = Weights(network, initial)
        self.target = Weights(network, initial.clone())
        self.gradient = Weights(network, torch.zeros_like(initial))
        self.mean = torch.zeros_like(initial)
        self.square = torch.zeros_like(initial)

    def tensors(self) -> dict[str, Tensor]:
        """Return everything that must be saved, each [S * P]."""
        return {"weights": self.weights.flat, "target": self.target.flat,
                "mean": self.mean, "square": self.square}

    def part(self, seeds: Sequence[int], count: int) -> dict[str, Tensor]:
        """Return copies of `tensors()` for some seeds, by their indices among all `count`.

        Where there are several networks of each seed, the first ones of all seeds come first.
        """
        copies = self.weights.flat.numel() // self.network.num_parameters // count
        members = [copy * count + seed for copy in range(copies) for seed in seeds]
        return {name: self.network.select(flat, members) for name, flat in self.tensors().items()}

    def autograd(self, loss: Loss, *arguments: Any) -> Any:
        """Return loss(weights, *arguments); leave the gradient of the sum of its losses in `gradient`."""
        with torch.enable_grad():
            layers = [layer.map(_leaf) for layer in self.weights.layers]
            outcome = loss(Weights(self.network, self.weights.flat, layers), *arguments)
            leaves = [block for layer in layers for block in layer.tensors()]
            gradients = _gradients(outcome, leaves)
        for block, gradient in zip((block for layer in self.gradient.layers for block in layer.tensors()),
                                   gradients, strict=True):
            block.copy_(gradient)
        return _detached(outcome)

    def step(self, rate: Tensor) -> None:
        """Make one step of Adam against `gradient`; `rate` is one row of `adam_rates`."""
        _adam_step(self.weights.flat, self.gradient.flat, self.mean, self.square, rate)

    def update_target(self, polyak: float) -> None:
        """Make a Polyak update: target <- polyak target + (1 - polyak) weights."""
        self.target.flat.lerp_(self.weights.flat, 1.0 - polyak)


class TrainedScalar:
    """One number for each seed [S], trained by Adam; see `TrainedNetwork`."""

    def __init__(self, values: Tensor, device: torch.device):
        self.values = values.to(device)
        self.gradient, self.mean, self.square = (torch.zeros_like(self.values) for _ in range(3))

    def tensors(self) -> dict[str, Tensor]:
        """Return everything that must be saved, each [S]."""
        return {"values": self.values, "mean": self.mean, "square": self.square}

    def part(self, seeds: Sequence[int], count: int) -> dict[str, Tensor]:
        """Return copies of `tensors()` for some seeds, by their indices among all `count`."""
        return {name: tensor[list(seeds)] for name, tensor in self.tensors().items()}

    def autograd(self, loss: Loss, *arguments: Any) -> Any:
        """Return loss(values, *arguments); leave the gradient of the sum of its losses in `gradient`."""
        with torch.enable_grad():
            leaf = _leaf(self.values)
            outcome = loss(leaf, *arguments)
            (gradient,) = _gradients(outcome, [leaf])
        self.gradient.copy_(gradient)
        return _detached(outcome)

    def step(self, rate: Tensor) -> None:
        """Make one step of Adam against `gradient`; `rate` is one row of `adam_rates`."""
        _adam_step(self.values, self.gradient, self.mean, self.square, rate)


def _leaf(block: Tensor) -> Tensor:
    return block.detach().requires_grad_()


def _gradients(outcome: Any, leaves: list[Tensor]) -> tuple[Tensor, ...]:
    losses = outcome[0] if isinstance(outcome, tuple) else outcome
    return torch.autograd.grad(losses.sum(), leaves)


def _detached(outcome: Any) -> Any:
    return tuple(part.detach() for part in outcome) if isinstance(outcome, tuple) else outcome.detach()


def _adam_step(weights: Tensor, gradient: Tensor, mean: Tensor, square: Tensor, rate: Tensor) -> None:
    step_size, epsilon = rate.unbind()
    mean.lerp_(gradient, 1.0 - BETA_1)
    square.mul_(BETA_2).addcmul_(gradient, gradient, value=1.0 - BETA_2)
    weights.sub_(mean.div(square.sqrt().add_(epsilon)).mul_(step_size))


def adam_rates(learning_rate: float, numbers: Iterable[int], device: torch.device) -> Tensor:
    """Return step sizes and epsilons [K, 2] of Adam's steps with these K numbers (counted from 1).

    The reordering of Kingma and Ba takes both bias corrections out of the loop over the parameters.

    Args:
        learning_rate: Adam's alpha.
        numbers: Which steps.
        device: Where the result lies.
    """
    steps = np.array(list(numbers), dtype=np.float64)
    correction = np.sqrt(1.0 - BETA_2**steps)
    rates = np.stack([learning_rate * correction / (1.0 - BETA_1**steps), ADAM_EPSILON * correction], axis=1)
    return torch.from_numpy(rates.astype(np.float32)).to(device)


def load_tensors(tensors: Mapping[str, Tensor], state: Mapping[str, np.ndarray], others: Sequence[str],
                 seeds: Sequence[int]) -> None:
    """Fill the tensors of a stack of agents from what was saved of it; nothing is changed where it does not fit.

    Args:
        tensors: By name.
        state: What was saved, by name.
        others: What else must have been saved, beside the seeds.
        seeds: Those of the stack.

    Raises:
        Mismatch: something is missing, or of other networks or seeds.
    """
    missing = {*tensors, *others, "seeds"} - set(state)
    if missing:
        raise Mismatch(f"this is not the state of such an agent: {sorted(missing)[0]} is missing")
    if tuple(np.ravel(state["seeds"])) != tuple(seeds):
        raise Mismatch(f"state of the seeds {np.ravel(state['seeds'])}, expected {tuple(seeds)}")
    for name, tensor in tensors.items():
        if np.shape(state[name]) != tuple(tensor.shape):
            raise Mismatch(f"{name} has the shape {np.shape(state[name])}, expected {tuple(tensor.shape)}; the state "
                           "is of an agent with other settings")
    for name, tensor in tensors.items():
        tensor.copy_(torch.from_numpy(np.ascontiguousarray(state[name])))
