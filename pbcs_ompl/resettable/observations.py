"""Observations as vectors: what the environment reports, as policies see it."""

from typing import Any

import numpy as np

from pbcs_ompl.core.types import Array


def flat(observation: Any) -> Array:
    """Return an observation as one vector; the entries of a dictionary in the order of their names."""
    if isinstance(observation, dict):
        return np.concatenate([flat(observation[key]) for key in sorted(observation)])
    return np.array(observation, dtype=np.float64).ravel()
