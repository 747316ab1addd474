"""The check of batches at the border of an environment."""

from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.types import Array


def check_batch(name: str, values: Any, size: int, error: type[InvalidState] | type[InvalidOption]) -> Array:
    """Return a batch of vectors as a contiguous array [B, size] of float64.

    Args:
        name: What the vectors are, for the message.
        values: The vectors.
        size: The length of each.
        error: What is raised.

    Raises:
        InvalidState, InvalidOption: another shape, or a number that is not finite.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != size:
        raise error(f"{name}: expected an array of shape [B, {size}], got {list(array.shape)}")
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise error(f"{name}: row {row} is not finite: {array[row].tolist()}")
    return array
