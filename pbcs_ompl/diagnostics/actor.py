"""What an actor does all over the state space."""

from collections.abc import Callable

import numpy as np

from pbcs_ompl.core.types import Array

Act = Callable[[Array], Array]
"""Actions [S, B, A] for observations [S, B, O]."""


def saturation(act: Act, observations: Array, low: Array, high: Array, *, margin: float = 0.01) -> Array:
    """Return the share of action components that lie at an end of the box [S].

    Args:
        observations: Where to ask [S, B, O].
        low, high: The action box [A].
        margin: What counts as the end, as a share of the box's width.
    """
    unit = (act(observations) - low) / (high - low)
    return ((unit <= margin) | (unit >= 1.0 - margin)).mean(axis=(1, 2))


def largest_actions(act: Act, observations: Array) -> Array:
    """Return max |pi(s)| over the observations [S, B, O] and the components [S]; [Matheron2020] Fig. 6.4(b)."""
    return np.abs(act(observations)).max(axis=(1, 2))
