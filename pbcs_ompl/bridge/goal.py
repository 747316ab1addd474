"""The environment's goal as a region OMPL can test."""

from math import inf, isnan
from typing import Any

import numpy as np
from ompl import base as ob

from pbcs_ompl.bridge.layout import blocks, state_reader
from pbcs_ompl.bridge.watch import Watch
from pbcs_ompl.core.errors import CallbackFailed
from pbcs_ompl.core.interfaces import ResettableModel


class EnvironmentGoal(ob.GoalRegion):
    """The states whose `model.goal_distance` is below (strictly) `model.goal_threshold`.

    The region cannot be sampled, so no planner can steer towards it: all explore without goal bias, as in
    [Matheron2020] ch. 3, whatever bias they are set to.
    """

    def __init__(self, space_information: Any, model: ResettableModel, watch: Watch):
        super().__init__(space_information)
        self.setThreshold(float(model.goal_threshold))
        self._read = state_reader(blocks(len(model.state_low), model.feature_dims))
        self._distance = model.goal_distance
        self._state = np.empty((1, len(model.state_low)))
        self._watch = watch

    def distanceGoal(self, state: Any) -> float:
        """Return the distance from `state` to the goal; infinite once a callback has failed."""
        watch = self._watch
        try:
            if watch.error is not None:
                return inf
            self._state[0] = self._read(state)
            distance = float(self._distance(self._state)[0])
            if isnan(distance):
                raise CallbackFailed(f"the goal distance of state {self._state[0].tolist()} is NaN")
            return distance
        except BaseException as error:  # nothing may cross OMPL's C++; `Watch.raise_error` raises it
            watch.fail(error)
            return inf
