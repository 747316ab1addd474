"""Laws from which the parameters of new networks are drawn, each one as in a library that results were made with.

[Matheron2020] depends on them: DDPG gets stuck in 1D-Toy now and then with "glorot" (6.2.2), and hardly with "torch".
"""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

SMALL_OUTPUTS = 3e-3
"""Bound of the weights of the last layer in OpenAI Baselines (2018), as in Lillicrap et al. (2015)."""


class Bounds(NamedTuple):
    """The largest weight and the largest bias of a new layer; both are uniform between minus and plus that number."""

    weight: float
    bias: float


def torch_bounds(fan_in: int, fan_out: int, last: bool) -> Bounds:
    """Return +-1/sqrt(inputs) for weights and biases: torch.nn.Linear.

    Args:
        fan_in, fan_out: Inputs and outputs of the layer.
        last: Whether it makes the outputs of the network.
    """
    return Bounds(fan_in**-0.5, fan_in**-0.5)


def glorot_bounds(fan_in: int, fan_out: int, last: bool) -> Bounds:
    """Return +-sqrt(6 / (inputs + outputs)) for weights, 0 for biases; see `torch_bounds` for the arguments.

    Source: tf.layers.dense, so Spinning Up (2018), spinup/algos/ddpg/core.py; Glorot and Bengio (2010), Eq. 16. A new
    network without biases is 0 in 0: an actor's first action there is the middle of the box.
    """
    return Bounds((6.0 / (fan_in + fan_out)) ** 0.5, 0.0)


def baselines_bounds(fan_in: int, fan_out: int, last: bool) -> Bounds:
    """Return +-3e-3 for the weights of the last layer, else as `glorot_bounds`.

    Source: OpenAI Baselines (2018), baselines/ddpg/models.py.
    """
    return Bounds(SMALL_OUTPUTS, 0.0) if last else glorot_bounds(fan_in, fan_out, last)


INITIALISATIONS: dict[str, Callable[[int, int, bool], Bounds]] = {
    "torch": torch_bounds, "glorot": glorot_bounds, "baselines": baselines_bounds}


def draw_layer(bounds: Bounds, fan_in: int, fan_out: int,
               generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw the weight [in, out] and the bias [1, out] of a new layer.

    NumPy's generators: torch's use 32 bits of their seed on a CPU, too few for stacks of many seeds.

    Args:
        bounds: Of both.
        fan_in, fan_out: Inputs and outputs of the layer.
        generator: Of one seed.
    """
    weight = generator.uniform(-bounds.weight, bounds.weight, (fan_in, fan_out))
    return weight, generator.uniform(-bounds.bias, bounds.bias, (1, fan_out))


def layer_shapes(sizes: tuple[int, ...], late_inputs: int) -> list[tuple[int, int]]:
    """Return inputs and outputs of each layer, if the last inputs of the network skip the first layer.

    Args:
        sizes: Widths of the network, from its inputs to its outputs.
        late_inputs: How many of its inputs join the values of the first hidden layer.
    """
    shapes = list(pairwise(sizes))
    shapes[0] = (shapes[0][0] - late_inputs, shapes[0][1])
    shapes[1:2] = [(fan_in + late_inputs, fan_out) for fan_in, fan_out in shapes[1:2]]
    return shapes
