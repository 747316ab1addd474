"""OMPL's state validity: bounds and collisions, for states that the environment has not just produced."""

from collections.abc import Callable
from typing import Any

import numpy as np

from pbcs_ompl.bridge.layout import blocks, state_reader
from pbcs_ompl.bridge.watch import Watch
from pbcs_ompl.core.interfaces import ResettableModel


def make_validity(model: ResettableModel, watch: Watch) -> Callable[[Any], bool]:
    """Return the callback is_valid(state): in the bounds, and `model.is_valid` (FCL where there are walls).

    A state that the propagator has just produced is one the environment is in; it is not tested again, so
    stock planners pay for collision checks only on states they made up (as EST does when it samples near a
    state). Once the problem has stopped no propagated state is valid, so planners do not grow from a
    refused step.
    """
    read = state_reader(blocks(len(model.state_low), model.feature_dims))
    low, high = model.state_low.tolist(), model.state_high.tolist()

    def is_valid(state: Any) -> bool:
        try:
            if watch.refused or watch.error is not None:
                return False
            values = read(state)
            if values == watch.reached:
                return True
            for value, least, most in zip(values, low, high, strict=True):
                if not least <= value <= most:
                    return False
            watch.validity_checks += 1
            return bool(model.is_valid(np.array([values]))[0])
        except BaseException as error:  # nothing may cross OMPL's C++; `Watch.raise_error` raises it
            watch.fail(error)
            return False

    return is_valid
