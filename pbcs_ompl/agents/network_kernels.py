"""Networks of `networks.py` as kernels, for one seed of a stack on a CPU (without layer norm).

A pass works in one flat array, the tape: the inputs [B, sizes[0]], the values of the first layer
[B, sizes[1]], and so on to the outputs, one block after the other. Slopes (derivatives of the loss by these
values) lie in an array of the same shape. `flat` is the buffer of a whole stack, of which `seed` takes its
share of each block; a gradient is a buffer of one seed.
"""

import numpy as np
from numba import njit

from pbcs_ompl.agents.matrix_kernels import product, transpose

Sizes = tuple[int, ...]
BETA_1, BETA_2 = 0.9, 0.999
"""Of Adam: how slowly the means of the slopes and of their squares forget."""
FAST = {"contract", "reassoc", "nsz", "arcp"}
"""Sums in any order and fused, but NaN and infinity stay what they are: they must be noticed."""


@njit(cache=True)
def tape_length(sizes: Sizes, batch: int) -> int:
    """Length of the tape of a pass."""
    return batch * sum(sizes)


@njit(cache=True)
def outputs_at(sizes: Sizes, batch: int) -> int:
    """Where the outputs begin on the tape."""
    return batch * (sum(sizes) - sizes[-1])


@njit(cache=True)
def parameters_at(sizes: Sizes, layer: int, seeds: int, seed: int) -> tuple[int, int]:
    """Where the weight and the bias of one layer and seed begin in the buffer of a stack."""
    start = 0
    for index in range(layer):
        start += (sizes[index] + 1) * sizes[index + 1]
    block = sizes[layer] * sizes[layer + 1]
    return seeds * start + seed * block, seeds * (start + block) + seed * sizes[layer + 1]


@njit(cache=True, fastmath=FAST)
def forward(sizes: Sizes, flat: np.ndarray, seeds: int, seed: int, tape: np.ndarray, batch: int) -> None:
    """Fill the tape behind the inputs."""
    start, layers = 0, len(sizes) - 1
    for layer in range(layers):
        width, wide = sizes[layer], sizes[layer + 1]
        weight, bias = parameters_at(sizes, layer, seeds, seed)
        out = start + batch * width
        product(tape, start, width, 1, flat, weight, tape, out, (batch, wide, width))
        values = tape[out : out + batch * wide].reshape(batch, wide)
        _add_bias(values, flat[bias : bias + wide], layer < layers - 1)
        start = out


@njit(cache=True, fastmath=FAST)
def _add_bias(values: np.ndarray, bias: np.ndarray, hidden: bool) -> None:
    """Add the bias [out] to values [B, out], and cut a hidden layer's negative ones (NaN stays)."""
    if hidden:
        for item in range(values.shape[0]):
            for j in range(values.shape[1]):
                value = values[item, j] + bias[j]
                values[item, j] = np.float32(0.0) if value < 0.0 else value
    else:
        for item in range(values.shape[0]):
            for j in range(values.shape[1]):
                values[item, j] += bias[j]


@njit(cache=True, fastmath=FAST)
def _add_rows(rows: np.ndarray, total: np.ndarray) -> None:
    total[:] = 0.0
    for item in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            total[j] += rows[item, j]


@njit(cache=True, fastmath=FAST)
def _cut(slopes: np.ndarray, values: np.ndarray) -> None:
    """Let slopes pass where a hidden layer's values are positive."""
    for i in range(len(values)):
        slopes[i] = slopes[i] if values[i] > 0.0 else np.float32(0.0)


@njit(cache=True, fastmath=FAST)
def backward(sizes: Sizes, flat: np.ndarray, seeds: int, seed: int, tape: np.ndarray, slopes: np.ndarray,
             batch: int, gradient: np.ndarray, to_inputs: bool) -> None:
    """Hand the outputs' slopes down, to the inputs if wanted; fill `gradient` [P] unless it is empty."""
    below = outputs_at(sizes, batch)
    for layer in range(len(sizes) - 2, -1, -1):
        width, wide = sizes[layer], sizes[layer + 1]
        out, below = below, below - batch * width
        if len(gradient):
            weight, bias = parameters_at(sizes, layer, 1, 0)
            product(tape, below, 1, width, slopes, out, gradient, weight, (width, wide, batch))
            _add_rows(slopes[out : out + batch * wide].reshape(batch, wide), gradient[bias : bias + wide])
        if layer > 0 or to_inputs:
            turned = np.empty(width * wide, dtype=np.float32)
            transpose(flat, parameters_at(sizes, layer, seeds, seed)[0], turned, 0, width, wide)
            product(slopes, out, wide, 1, turned, 0, slopes, below, (batch, width, wide))
        if layer > 0:
            _cut(slopes[below:out], tape[below:out])


@njit(cache=True, fastmath=FAST)
def descend(sizes: Sizes, weights: np.ndarray, mean: np.ndarray, square: np.ndarray, seeds: int, seed: int,
            gradient: np.ndarray, rate: np.ndarray) -> None:
    """Make one step of Adam for one seed against its gradient [P]; `rate` is one row of `adam_rates`."""
    start = 0
    for layer in range(len(sizes) - 1):
        wide = sizes[layer + 1]
        weight, bias = parameters_at(sizes, layer, seeds, seed)
        for place, length in ((weight, sizes[layer] * wide), (bias, wide)):
            own = slice(place, place + length)
            _adam(weights[own], mean[own], square[own], gradient[start : start + length], rate[0], rate[1])
            start += length


# Python's error model would check every division, and so keep the loop from being turned into vectors.
@njit(cache=True, fastmath=FAST, error_model="numpy")
def _adam(weights: np.ndarray, mean: np.ndarray, square: np.ndarray, gradient: np.ndarray, step: float,
          epsilon: float) -> None:
    tiny = np.float32(1e-30)
    for i in range(len(weights)):
        slope = gradient[i]
        m = mean[i] + np.float32(1.0 - BETA_1) * (slope - mean[i])
        v = np.float32(BETA_2) * square[i] + np.float32(1.0 - BETA_2) * slope * slope
        # Moments of a unit that is never active decay for ever; as denormal numbers they would slow it all.
        m = m if abs(m) > tiny else np.float32(0.0)
        v = v if v > tiny else np.float32(0.0)
        mean[i], square[i] = m, v
        weights[i] -= step * m / (np.sqrt(v) + epsilon)


@njit(cache=True, fastmath=FAST)
def follow(sizes: Sizes, weights: np.ndarray, target: np.ndarray, seeds: int, seed: int,
           share: float) -> None:
    """Move one seed's target: target <- target + share (weights - target)."""
    for layer in range(len(sizes) - 1):
        wide = sizes[layer + 1]
        weight, bias = parameters_at(sizes, layer, seeds, seed)
        for place, length in ((weight, sizes[layer] * wide), (bias, wide)):
            behind, ahead = target[place : place + length], weights[place : place + length]
            for i in range(length):
                behind[i] += share * (ahead[i] - behind[i])


@njit(cache=True)
def outputs(sizes: Sizes, flat: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Return the outputs [B, out] of one network for inputs [B, in]."""
    batch = inputs.shape[0]
    tape = np.empty(tape_length(sizes, batch), np.float32)
    tape[: batch * sizes[0]] = inputs.ravel()
    forward(sizes, flat, 1, 0, tape, batch)
    return tape[outputs_at(sizes, batch) :].reshape(batch, sizes[-1])
