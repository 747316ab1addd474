"""Networks of `networks.py` as kernels, for one seed of a stack on a CPU (without layer norm).

A pass works in one flat array, the activations: the inputs [B, sizes[0]], the values of the first layer
[B, sizes[1]], and so on to the outputs, one block after the other. Gradients (derivatives of the loss by these
values) lie in an array of the same shape. `flat` is the buffer of a whole stack, in which every seed has its part of
each block; a gradient is a buffer of one seed.
"""

import numpy as np

from pbcs_ompl.agents.kernels.matrix import product, transpose
from pbcs_ompl.core.compiled import njit

Sizes = tuple[int, ...]
BETA_1, BETA_2 = 0.9, 0.999
"""Of Adam (Kingma and Ba, 2015): decay rates of the means of the gradient and of its square."""
FAST = {"contract", "reassoc", "nsz", "arcp"}
"""Sums in any order and fused, but NaN and infinity stay what they are: they must be noticed."""


@njit()
def num_activations(sizes: Sizes, batch: int) -> int:
    """Length of the activations of a pass."""
    return batch * sum(sizes)


@njit()
def outputs_offset(sizes: Sizes, batch: int) -> int:
    """Where the outputs begin among the activations."""
    return batch * (sum(sizes) - sizes[-1])


@njit()
def parameter_offsets(sizes: Sizes, layer: int, seeds: int, seed: int) -> tuple[int, int]:
    """Where the weight and the bias of one layer and seed begin in the buffer of a stack."""
    start = 0
    for index in range(layer):
        start += (sizes[index] + 1) * sizes[index + 1]
    block = sizes[layer] * sizes[layer + 1]
    return seeds * start + seed * block, seeds * (start + block) + seed * sizes[layer + 1]


@njit(fastmath=FAST)
def forward(sizes: Sizes, flat: np.ndarray, seeds: int, seed: int, activations: np.ndarray, batch: int) -> None:
    """Compute the activations behind the inputs."""
    start, layers = 0, len(sizes) - 1
    for layer in range(layers):
        fan_in, fan_out = sizes[layer], sizes[layer + 1]
        weight, bias = parameter_offsets(sizes, layer, seeds, seed)
        out = start + batch * fan_in
        product(activations, start, fan_in, 1, flat, weight, activations, out, (batch, fan_out, fan_in))
        values = activations[out : out + batch * fan_out].reshape(batch, fan_out)
        _add_bias(values, flat[bias : bias + fan_out], layer < layers - 1)
        start = out


@njit(fastmath=FAST)
def _add_bias(values: np.ndarray, bias: np.ndarray, hidden: bool) -> None:
    """Add the bias [out] to values [B, out], and set negative ones of a hidden layer to 0 (NaN stays)."""
    if hidden:
        for item in range(values.shape[0]):
            for j in range(values.shape[1]):
                value = values[item, j] + bias[j]
                values[item, j] = np.float32(0.0) if value < 0.0 else value
    else:
        for item in range(values.shape[0]):
            for j in range(values.shape[1]):
                values[item, j] += bias[j]


@njit(fastmath=FAST)
def _add_rows(rows: np.ndarray, total: np.ndarray) -> None:
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
def backward(sizes: Sizes, flat: np.ndarray, seeds: int, seed: int, activations: np.ndarray, grads: np.ndarray,
             batch: int, gradient: np.ndarray) -> None:
    """Propagate the outputs' gradients back and fill `gradient` [P]; to the inputs instead where it is empty."""
    to_inputs = len(gradient) == 0
    below = outputs_offset(sizes, batch)
    for layer in range(len(sizes) - 2, -1, -1):
        fan_in, fan_out = sizes[layer], sizes[layer + 1]
        out, below = below, below - batch * fan_in
        if not to_inputs:
            weight, bias = parameter_offsets(sizes, layer, 1, 0)
            product(activations, below, 1, fan_in, grads, out, gradient, weight, (fan_in, fan_out, batch))
            _add_rows(grads[out : out + batch * fan_out].reshape(batch, fan_out), gradient[bias : bias + fan_out])
        if layer > 0 or to_inputs:
            transposed = np.empty(fan_in * fan_out, dtype=np.float32)
            transpose(flat, parameter_offsets(sizes, layer, seeds, seed)[0], transposed, 0, fan_in, fan_out)
            product(grads, out, fan_out, 1, transposed, 0, grads, below, (batch, fan_in, fan_out))
        if layer > 0:
            _relu_backward(grads[below:out], activations[below:out])


@njit(fastmath=FAST)
def adam_step(sizes: Sizes, weights: np.ndarray, mean: np.ndarray, square: np.ndarray, seeds: int, seed: int,
            gradient: np.ndarray, rate: np.ndarray) -> None:
    """Make one step of Adam for one seed against its gradient [P]; `rate` is one row of `adam_rates`."""
    start = 0
    for layer in range(len(sizes) - 1):
        fan_out = sizes[layer + 1]
        weight, bias = parameter_offsets(sizes, layer, seeds, seed)
        for offset, length in ((weight, sizes[layer] * fan_out), (bias, fan_out)):
            part = slice(offset, offset + length)
            _adam(weights[part], mean[part], square[part], gradient[start : start + length], rate[0], rate[1])
            start += length


# Python's error model would check every division, and so prevent vectorisation of the loop.
@njit(fastmath=FAST, error_model="numpy")
def _adam(weights: np.ndarray, mean: np.ndarray, square: np.ndarray, gradient: np.ndarray, step: float,
          epsilon: float) -> None:
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
def polyak_update(sizes: Sizes, weights: np.ndarray, target: np.ndarray, seeds: int, seed: int,
           tau: np.float32) -> None:
    """Move one seed's target: target <- target + tau (weights - target)."""
    for layer in range(len(sizes) - 1):
        fan_out = sizes[layer + 1]
        weight, bias = parameter_offsets(sizes, layer, seeds, seed)
        for offset, length in ((weight, sizes[layer] * fan_out), (bias, fan_out)):
            slow, fast = target[offset : offset + length], weights[offset : offset + length]
            for i in range(length):
                slow[i] += tau * (fast[i] - slow[i])


@njit()
def outputs(sizes: Sizes, parameters: np.ndarray, inputs: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the outputs [B, out] of the networks `chosen` [B], with parameters [N, P], for inputs [B, in]."""
    fan_in, fan_out = sizes[0], sizes[-1]
    results = np.empty((len(inputs), fan_out), np.float32)
    rows = np.empty(len(inputs), np.int64)
    for network in range(len(parameters)):
        batch = 0
        for row in range(len(inputs)):
            if chosen[row] == network:
                rows[batch] = row
                batch += 1
        if batch == 0:
            continue
        activations = np.empty(num_activations(sizes, batch), np.float32)
        for k in range(batch):
            activations[k * fan_in : (k + 1) * fan_in] = inputs[rows[k]]
        forward(sizes, parameters[network], 1, 0, activations, batch)
        first = outputs_offset(sizes, batch)
        for k in range(batch):
            results[rows[k]] = activations[first + k * fan_out : first + (k + 1) * fan_out]
    return results
