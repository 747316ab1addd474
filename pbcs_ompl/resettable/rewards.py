"""When two rewards are the same: states and observations have to agree in every bit, rewards but for rounding."""

from typing import Any

import numpy as np

ROUNDING = 1e-12
"""Largest difference of rewards that is rounding, as a fraction of them, or of 1 where they are smaller.

A sum over a Python set, such as gym-pusht's area of several shapes, depends on where its members lie in memory.
"""


def same_rewards(one: Any, other: Any) -> bool:
    """Return whether rewards, one or [T], are the same but for rounding; NaN is the same as NaN."""
    return bool(np.allclose(one, other, rtol=ROUNDING, atol=ROUNDING, equal_nan=True))
