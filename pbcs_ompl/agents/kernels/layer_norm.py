"""Layer norm and its derivative, for one network on a CPU: gain n + shift, n = (v - mean) / sqrt(variance + epsilon).

Source: Ba, Kiros and Hinton (2016), Eqs. 3 and 4; epsilon as in torch.nn.LayerNorm.
"""

import numpy as np

from pbcs_ompl.agents.kernels import FAST
from pbcs_ompl.core.compiled import njit

LAYER_NORM_EPSILON = 1e-5


@njit(fastmath=FAST, error_model="numpy")
def normalise(values: np.ndarray, gain: np.ndarray, shift: np.ndarray, epsilon: np.float32, normal: np.ndarray,
              inverse: np.ndarray) -> None:
    """Replace values [B, N] by gain n + shift.

    Args:
        values: Of one layer, before its ReLU.
        gain, shift: What is learnt [N].
        epsilon: Of the equation above.
        normal: Filled with n [B, N].
        inverse: Filled with 1 / sqrt(variance + epsilon) [B].
    """
    batch, width = values.shape
    part = np.float32(1.0 / width)
    for item in range(batch):
        total = np.float32(0.0)
        for j in range(width):
            total += values[item, j]
        mean, squares = total * part, np.float32(0.0)
        for j in range(width):
            squares += (values[item, j] - mean) * (values[item, j] - mean)
        scale = np.float32(1.0) / np.sqrt(squares * part + epsilon)
        inverse[item] = scale
        for j in range(width):
            normal[item, j] = (values[item, j] - mean) * scale
            values[item, j] = gain[j] * normal[item, j] + shift[j]


@njit(fastmath=FAST, error_model="numpy")
def normalise_backward(grads: np.ndarray, gain: np.ndarray, normal: np.ndarray, inverse: np.ndarray) -> None:
    """Replace derivatives by gain n + shift [B, N] by those by the values that were normalised.

    Args:
        grads: What is replaced.
        gain: [N].
        normal, inverse: Of `normalise`.
    """
    batch, width = grads.shape
    part = np.float32(1.0 / width)
    for item in range(batch):
        total, along = np.float32(0.0), np.float32(0.0)
        for j in range(width):
            grads[item, j] *= gain[j]
            total += grads[item, j]
            along += grads[item, j] * normal[item, j]
        total, along, scale = total * part, along * part, inverse[item]
        for j in range(width):
            grads[item, j] = (grads[item, j] - total - along * normal[item, j]) * scale


@njit(fastmath=FAST)
def gain_gradient(grads: np.ndarray, normal: np.ndarray, by_gain: np.ndarray) -> None:
    """Fill the derivative by the gain [N]: the sum of grads n over the mini-batch; see `normalise_backward`."""
    by_gain[:] = 0.0
    for item in range(grads.shape[0]):
        for j in range(grads.shape[1]):
            by_gain[j] += grads[item, j] * normal[item, j]
