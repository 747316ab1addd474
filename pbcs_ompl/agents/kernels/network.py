"""Networks of `networks.py` as kernels, for one network of a stack on a CPU.

A pass works in one flat array, the activations: the inputs [B, sizes[0]], the values of the first layer
[B, sizes[1]], and so on to the outputs, one block after the other. Behind them is what normalised layers keep: a
second array like the first, of values before gain and shift, and [B] inverse deviations of each layer. Gradients
(derivatives of the loss by the values) lie in an array like the first. `flat` is the buffer of a whole stack, in which
every network has its part of each block; a gradient is a buffer of one network.
"""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.agents.kernels import FAST
from pbcs_ompl.agents.kernels.layer_norm import LAYER_NORM_EPSILON, gain_gradient, normalise, normalise_backward
from pbcs_ompl.agents.kernels.matrix import product, transpose
from pbcs_ompl.core.compiled import njit

BETA_1, BETA_2 = 0.9, 0.999
"""Of Adam (Kingma and Ba, 2015): decay rates of the means of the gradient and of its square."""


class Shape(NamedTuple):
    """The shape of the networks of a stack."""

    sizes: tuple[int, ...]
    epsilon: np.float32 | None
    """Of the layer norm of hidden layers; None if they have none, and then nothing of it is compiled."""


def shape_of(sizes: tuple[int, ...], layer_norm: bool) -> Shape:
    """Return the shape of networks whose hidden layers may be normalised."""
    return Shape(sizes, np.float32(LAYER_NORM_EPSILON) if layer_norm else None)


class Member(NamedTuple):
    """One network of a stack."""

    total: int
    """Networks of the stack."""
    place: int
    """Which of them."""


ALONE = Member(1, 0)
"""A network that is no stack."""


@njit()
def num_activations(shape: Shape, batch: int) -> int:
    """Length of the activations of a pass."""
    values = batch * sum(shape.sizes)
    return values if shape.epsilon is None else 2 * values + batch * len(shape.sizes)


@njit()
def outputs_offset(shape: Shape, batch: int) -> int:
    """Where the outputs begin among the activations."""
    return batch * (sum(shape.sizes) - shape.sizes[-1])


@njit()
def num_blocks(shape: Shape, layer: int) -> int:
    """Blocks of parameters of a layer: weight and bias, and gain and shift if it is normalised."""
    return 2 if shape.epsilon is None or layer == len(shape.sizes) - 2 else 4


@njit()
def parameter_offsets(shape: Shape, layer: int, member: Member) -> tuple[int, int, int, int]:
    """Where weight, bias, gain and shift of one layer begin in the buffer of a stack, those that it has."""
    sizes, start = shape.sizes, 0
    for before in range(layer):
        start += (sizes[before] + num_blocks(shape, before) - 1) * sizes[before + 1]
    block, width = sizes[layer] * sizes[layer + 1], sizes[layer + 1]
    bias = member.total * (start + block) + member.place * width
    return (member.total * start + member.place * block, bias, bias + member.total * width,
            bias + 2 * member.total * width)


@njit(fastmath=FAST)
def forward(shape: Shape, flat: np.ndarray, member: Member, activations: np.ndarray, batch: int) -> None:
    """Compute the activations behind the inputs."""
    start, layers = 0, len(shape.sizes) - 1
    for layer in range(layers):
        fan_in, fan_out = shape.sizes[layer], shape.sizes[layer + 1]
        weight, bias, _, _ = parameter_offsets(shape, layer, member)
        out = start + batch * fan_in
        product(activations, start, fan_in, 1, flat, weight, activations, out, (batch, fan_out, fan_in))
        values = activations[out : out + batch * fan_out].reshape(batch, fan_out)
        _add_bias(values, flat[bias : bias + fan_out])
        if layer < layers - 1:
            _normalise(shape.epsilon, shape, flat, member, layer, activations, out, values)
            _relu(values)
        start = out


@njit(fastmath=FAST)
def _add_bias(values: np.ndarray, bias: np.ndarray) -> None:
    for item in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[item, j] += bias[j]


@njit(fastmath=FAST)
def _relu(values: np.ndarray) -> None:
    """Set negative values to 0; NaN stays."""
    for item in range(values.shape[0]):
        for j in range(values.shape[1]):
            value = values[item, j]
            values[item, j] = np.float32(0.0) if value < 0.0 else value


@njit(inline="always")
def _norm_views(shape: Shape, layer: int, activations: np.ndarray, out: int,
                batch: int) -> tuple[np.ndarray, np.ndarray]:
    """Values [B, N] of a layer before gain and shift, and inverse deviations [B]; its outputs begin at `out`."""
    behind, width = batch * sum(shape.sizes), shape.sizes[layer + 1]
    inverse = 2 * behind + batch * layer
    return (activations[behind + out : behind + out + batch * width].reshape(batch, width),
            activations[inverse : inverse + batch])


# Numba omits a branch on None only if what is compared is an argument.
@njit()
def _normalise(epsilon: np.float32 | None, shape: Shape, flat: np.ndarray, member: Member, layer: int,
               activations: np.ndarray, out: int, values: np.ndarray) -> None:
    if epsilon is not None:
        batch, width = values.shape
        _, _, gain, shift = parameter_offsets(shape, layer, member)
        normal, inverse = _norm_views(shape, layer, activations, out, batch)
        normalise(values, flat[gain : gain + width], flat[shift : shift + width], epsilon, normal, inverse)


@njit()
def _normalise_backward(epsilon: np.float32 | None, shape: Shape, flat: np.ndarray, member: Member, layer: int,
                        activations: np.ndarray, out: int, grads: np.ndarray, gradient: np.ndarray) -> None:
    if epsilon is not None:
        batch, width = grads.shape
        _, _, gain, _ = parameter_offsets(shape, layer, member)
        normal, inverse = _norm_views(shape, layer, activations, out, batch)
        if len(gradient) > 0:
            _, _, by_gain, by_shift = parameter_offsets(shape, layer, ALONE)
            gain_gradient(grads, normal, gradient[by_gain : by_gain + width])
            add_rows(grads, gradient[by_shift : by_shift + width])
        normalise_backward(grads, flat[gain : gain + width], normal, inverse)


@njit(fastmath=FAST)
def add_rows(rows: np.ndarray, total: np.ndarray) -> None:
    """Fill the sum [N] of rows [B, N]."""
    total[:] = 0.0
    for item in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            total[j] += rows[item, j]


@njit(fastmath=FAST)
def _relu_backward(grads: np.ndarray, values: np.ndarray) -> None:
    """Let gradients pass where a hidden layer's values are positive."""
    for i in range(len(values)):
        grads[i] = grads[i] if values[i] > 0.0 else np.float32(0.0)


@njit(fastmath=FAST)
def backward(shape: Shape, flat: np.ndarray, member: Member, activations: np.ndarray, grads: np.ndarray,
             batch: int, gradient: np.ndarray) -> None:
    """Propagate the outputs' gradients back and fill `gradient` [P]; to the inputs instead where it is empty."""
    sizes, to_inputs = shape.sizes, len(gradient) == 0
    below = outputs_offset(shape, batch)
    for layer in range(len(sizes) - 2, -1, -1):
        fan_in, fan_out = sizes[layer], sizes[layer + 1]
        out, below = below, below - batch * fan_in
        if not to_inputs:
            weight, bias, _, _ = parameter_offsets(shape, layer, ALONE)
            product(activations, below, 1, fan_in, grads, out, gradient, weight, (fan_in, fan_out, batch))
            add_rows(grads[out : out + batch * fan_out].reshape(batch, fan_out), gradient[bias : bias + fan_out])
        if layer > 0 or to_inputs:
            transposed = np.empty(fan_in * fan_out, dtype=np.float32)
            weight, _, _, _ = parameter_offsets(shape, layer, member)
            transpose(flat, weight, transposed, 0, fan_in, fan_out)
            product(grads, out, fan_out, 1, transposed, 0, grads, below, (batch, fan_in, fan_out))
        if layer > 0:
            _relu_backward(grads[below:out], activations[below:out])
            _normalise_backward(shape.epsilon, shape, flat, member, layer - 1, activations, below,
                                grads[below:out].reshape(batch, fan_in), gradient)


@njit(fastmath=FAST)
def adam_step(shape: Shape, weights: np.ndarray, mean: np.ndarray, square: np.ndarray, member: Member,
              gradient: np.ndarray, rate: np.ndarray) -> None:
    """Make one step of Adam for one network against its gradient [P]; `rate` is one row of `adam_rates`."""
    start = 0
    for layer in range(len(shape.sizes) - 1):
        offsets = parameter_offsets(shape, layer, member)
        for block in range(num_blocks(shape, layer)):
            length = shape.sizes[layer + 1] * (shape.sizes[layer] if block == 0 else 1)
            offset = offsets[block]
            part = slice(offset, offset + length)
            adam(weights[part], mean[part], square[part], gradient[start : start + length], rate[0], rate[1])
            start += length


# Python's error model would check every division, and so prevent vectorisation of the loop.
@njit(fastmath=FAST, error_model="numpy")
def adam(weights: np.ndarray, mean: np.ndarray, square: np.ndarray, gradient: np.ndarray, step: float,
         epsilon: float) -> None:
    """Make one step of Adam for some numbers.

    Args:
        weights, mean, square, gradient: The numbers, their moments, and the gradient, of one length.
        step, epsilon: One row of `adam_rates`.
    """
    tiny = np.float32(1e-30)
    for i in range(len(weights)):
        grad = gradient[i]
        m = mean[i] + np.float32(1.0 - BETA_1) * (grad - mean[i])
        v = np.float32(BETA_2) * square[i] + np.float32(1.0 - BETA_2) * grad * grad
        # Moments of a unit that is never active decay for ever; as denormal numbers they would slow all updates.
        m = m if abs(m) > tiny else np.float32(0.0)
        v = v if v > tiny else np.float32(0.0)
        mean[i], square[i] = m, v
        weights[i] -= step * m / (np.sqrt(v) + epsilon)


@njit(fastmath=FAST)
def polyak_update(shape: Shape, weights: np.ndarray, target: np.ndarray, member: Member,
                  tau: np.float32) -> None:
    """Move one network's target: target <- target + tau (weights - target)."""
    for layer in range(len(shape.sizes) - 1):
        offsets = parameter_offsets(shape, layer, member)
        for block in range(num_blocks(shape, layer)):
            length = shape.sizes[layer + 1] * (shape.sizes[layer] if block == 0 else 1)
            offset = offsets[block]
            slow, fast = target[offset : offset + length], weights[offset : offset + length]
            for i in range(length):
                slow[i] += tau * (fast[i] - slow[i])


@njit()
def outputs(shape: Shape, parameters: np.ndarray, inputs: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the outputs [B, out] of the networks `chosen` [B], with parameters [N, P], for inputs [B, in]."""
    fan_in, fan_out = shape.sizes[0], shape.sizes[-1]
    results = np.empty((len(inputs), fan_out), np.float32)
    rows = np.empty(len(inputs), np.int64)
    for network in range(len(parameters)):
        batch = _find(chosen, network, rows)
        if batch == 0:
            continue
        activations = np.empty(num_activations(shape, batch), np.float32)
        for k in range(batch):
            for i in range(fan_in):
                activations[k * fan_in + i] = inputs[rows[k], i]
        forward(shape, parameters[network], ALONE, activations, batch)
        first = outputs_offset(shape, batch)
        for k in range(batch):
            for i in range(fan_out):
                results[rows[k], i] = activations[first + k * fan_out + i]
    return results


@njit()
def _find(chosen: np.ndarray, network: int, rows: np.ndarray) -> int:
    """Fill the rows where a network was chosen, and return their number."""
    count = 0
    for row in range(len(chosen)):
        if chosen[row] == network:
            rows[count] = row
            count += 1
    return count
