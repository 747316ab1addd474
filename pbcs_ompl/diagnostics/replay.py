"""What mini-batches are made of."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray


def rewarded_share(rewards: Array, mask: BoolArray | None = None) -> Array:
    """Return the share of transitions with a positive reward [S], and so their expected share in mini-batches.

    n updates on mini-batches of b transitions meet n b times this many ([Matheron2020] Fig. 6.3a).

    Args:
        rewards: The rewards in the replay buffers [S, N].
        mask: Which of them are filled [S, N]; None for all.

    Raises:
        InvalidOption: a buffer is empty.
    """
    mask = np.ones(rewards.shape, dtype=np.bool_) if mask is None else mask
    counts = mask.sum(axis=1)
    if not counts.all():
        raise InvalidOption("a replay buffer without transitions has no share of rewarded ones")
    return ((rewards > 0.0) & mask).sum(axis=1) / counts
