"""Rides without one of its parts, to see what each is worth: see the study `rides-ablation`."""

import numpy as np

from pbcs_ompl.core.errors import UnknownName
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.kernels.rides_loop import KIND, OPENED, SCALE, USED, WEIGHT
from pbcs_ompl.planners.rides import Rides

UNIFORM, SURFACE = 0, 1  # kinds of controls
EVER = 1e300
"""Bins opened and steps used, to which what a run adds changes no yield."""
PARTS = ("rides", "scales", "surface-controls", "uniform-controls", "stop-when-still", "stop-in-known-bins",
         "learnt-scales")
"""Without `rides` a control lasts one step, without `scales` there are bins alone, without a kind of controls all are
of the other, without a stop rides go on there, without `learnt-scales` all are equally likely."""


class RidesWithout(Rides):
    """Rides without one of its parts.

    Args:
        part: One of PARTS.

    Raises:
        UnknownName: it is not.
    """

    def __init__(self, part: str):
        if part not in PARTS:
            raise UnknownName("part of Rides", part, PARTS)
        super().__init__(**({"scales": 1} if part == "scales" else {}))
        self._part = part

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin without regions, and without the part."""
        super().start(context, rng)
        match self._part:
            case "rides":
                self._limits = self._limits._replace(steps=1)
            case "stop-when-still":
                self._limits = self._limits._replace(still=False)
            case "stop-in-known-bins":
                self._limits = self._limits._replace(known=context.episode_steps)
            case "surface-controls":
                self._yields[KIND, SURFACE, WEIGHT] = 0.0  # what is never chosen keeps its weight
            case "uniform-controls":
                self._yields[KIND, UNIFORM, WEIGHT] = 0.0
            case "learnt-scales":
                self._yields[SCALE, :, [OPENED, USED]] = EVER
