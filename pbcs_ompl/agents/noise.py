"""Exploration noise: how a behaviour policy differs from the actor."""

import numpy as np

from pbcs_ompl.core.contracts import Array
from pbcs_ompl.core.errors import InvalidOption


def epsilon_greedy(actions: Array, epsilon: float, low: Array, high: Array,
                   rng: np.random.Generator) -> Array:
    """Return actions [..., A] of which each is, with probability `epsilon`, redrawn uniformly from the box.

    The same number of random values is drawn whatever `epsilon` is and whatever is replaced.

    Raises:
        InvalidOption: `epsilon` is not a probability.
    """
    if not 0.0 <= epsilon <= 1.0:
        raise InvalidOption(f"epsilon is {epsilon}, expected a probability in [0, 1]")
    explore = rng.random(actions.shape[:-1]) < epsilon
    uniform = low + rng.random(actions.shape) * (high - low)
    return np.where(explore[..., None], uniform, actions)
