"""Multi-layer perceptrons stacked over seeds: S networks of one shape, in one flat buffer.

All parameters of a stack lie in one tensor, so that an optimiser or a moving average is a few flat
operations; the layers see views of it. Gradients are derived by hand (`backward`): for networks this small,
recording a graph costs half as much as the arithmetic. They equal torch.autograd's, and torch.compile takes
them as they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor

from pbcs_ompl.agents.policy import LAYER_NORM_EPSILON


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


class Weights:
    """The parameters (or the gradients) of a stack: a buffer and its layers, which are views of it."""

    def __init__(self, network: "MLP", flat: Tensor):
        self.flat = flat
        self._network = network
        self._layers = network.split(flat)

    @property
    def layers(self) -> list[Layer]:
        # A compiler must see that the views alias the buffer; eager code saves the time of making them.
        return self._network.split(self.flat) if torch.compiler.is_compiling() else self._layers


class Tape(NamedTuple):
    """What a forward pass leaves for the backward pass."""

    inputs: list[Tensor]
    """The input of every layer [S, B, in]."""
    norms: list[tuple[Tensor, Tensor]]
    """Normalised values [S, B, out] and inverse deviations [S, B, 1] of every layer norm."""


@dataclass(frozen=True)
class MLP:
    """ReLU network with a linear output layer; the parameters are kept apart.

    Args:
        sizes: Width of the input, of every hidden layer, and of the output.
        layer_norm: Normalise every hidden layer before its ReLU, with learnt gain and shift.
    """

    sizes: tuple[int, ...]
    layer_norm: bool = False

    @property
    def num_parameters(self) -> int:
        """Number P of parameters of one seed."""
        norm = 2 * sum(self.sizes[1:-1]) if self.layer_norm else 0
        return norm + sum((before + 1) * after for before, after in pairwise(self.sizes))

    def split(self, flat: Tensor) -> list[Layer]:
        """Return the layers of a buffer [S * P] as views: one contiguous block for each parameter."""
        seeds, start, layers = flat.shape[0] // self.num_parameters, 0, []

        def take(rows: int, width: int) -> Tensor:
            nonlocal start
            start += seeds * rows * width
            return flat[start - seeds * rows * width : start].view(seeds, rows, width)

        for index, (before, after) in enumerate(pairwise(self.sizes)):
            normed = self.layer_norm and index < len(self.sizes) - 2
            layers.append(Layer(take(before, after), take(1, after),
                                Norm(take(1, after), take(1, after)) if normed else None))
        return layers

    def take(self, flat: Tensor, members: Sequence[int]) -> Tensor:
        """Return the buffer of some networks of a stack, by their places in it."""
        chosen = torch.tensor(members, device=flat.device)
        return torch.cat([block[chosen].flatten() for layer in self.split(flat)
                          for block in (layer.weight, layer.bias, *(layer.norm or ()))])

    def initial(self, generators: Sequence[torch.Generator]) -> Tensor:
        """Draw parameters [S * P] as torch.nn.Linear does, each seed's from its own generator.

        Weights and biases are uniform in +-1/sqrt(number of inputs).
        """
        flat = torch.empty(len(generators) * self.num_parameters)
        for layer in self.split(flat):
            bound = layer.weight.shape[1] ** -0.5
            for weight, bias, generator in zip(layer.weight, layer.bias, generators, strict=True):
                weight.uniform_(-bound, bound, generator=generator)
                bias.uniform_(-bound, bound, generator=generator)
            if layer.norm is not None:
                layer.norm.gain.fill_(1.0)
                layer.norm.shift.zero_()
        return flat

    def forward(self, weights: Weights, inputs: Tensor) -> tuple[Tensor, Tape]:
        """Return the outputs [S, B, out] for inputs [S, B, in], and what `backward` needs."""
        tape = Tape([], [])
        *hidden, last = weights.layers
        values = inputs
        for weight, bias, norm in hidden:
            tape.inputs.append(values)
            values = torch.baddbmm(bias, values, weight)
            if norm is not None:
                normal, _, deviation = torch.native_layer_norm(
                    values, values.shape[-1:], None, None, LAYER_NORM_EPSILON)
                tape.norms.append((normal, deviation))
                values = torch.addcmul(norm.shift, normal, norm.gain)
            values = values.relu_()
        tape.inputs.append(values)
        return torch.baddbmm(last.bias, values, last.weight), tape

    def backward(self, weights: Weights, tape: Tape, slope: Tensor, gradient: Weights) -> None:
        """Fill `gradient` with the derivative of the loss by the parameters.

        Args:
            tape: Of `forward` with these weights.
            slope: Derivative of the loss by the outputs [S, B, out].
        """
        self._descend(weights.layers, tape, slope, gradient.layers)

    def input_slope(self, weights: Weights, tape: Tape, slope: Tensor) -> Tensor:
        """Return the derivative of the loss by the inputs [S, B, in]; see `backward`."""
        layers = weights.layers
        slope = self._descend(layers, tape, slope, None)
        return torch.bmm(slope, layers[0].weight.transpose(1, 2))

    @staticmethod
    def _descend(layers: list[Layer], tape: Tape, slope: Tensor, gradients: list[Layer] | None) -> Tensor:
        """Return the derivative by the first layer's sums [S, B, hidden]; fill `gradients` on the way."""
        last = len(layers) - 1
        for index in range(last, -1, -1):
            into = None if gradients is None else gradients[index]
            norm = layers[index].norm
            if index < last:
                slope = torch.ops.aten.threshold_backward(slope, tape.inputs[index + 1], 0.0)
            if norm is not None:
                learnt = None if into is None else into.norm
                slope = _norm_backward(norm.gain, tape.norms[index], slope, learnt)
            if into is not None:
                torch.bmm(tape.inputs[index].transpose(1, 2), slope, out=into.weight)
                torch.sum(slope, 1, keepdim=True, out=into.bias)
            if index > 0:
                slope = torch.bmm(slope, layers[index].weight.transpose(1, 2))
        return slope


def _norm_backward(gain: Tensor, norm: tuple[Tensor, Tensor], slope: Tensor, into: Norm | None) -> Tensor:
    normal, deviation = norm
    if into is not None:
        torch.sum(slope * normal, 1, keepdim=True, out=into.gain)
        torch.sum(slope, 1, keepdim=True, out=into.shift)
    slope = slope * gain
    along = (slope * normal).mean(-1, keepdim=True)
    return (slope - slope.mean(-1, keepdim=True)).addcmul(normal, along, value=-1.0).mul(deviation)
