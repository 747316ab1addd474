"""The grid over the workspace that OMPL's Syclop planners need."""

from importlib.metadata import version
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.core.errors import PlannerUnavailable, UnsupportedSpace

CELLS = 32
PROBES = 16


class PositionGrid(oc.GridDecomposition):
    """A grid over the first two dimensions of a real-vector state space."""

    def __init__(self, bounds: Any):
        super().__init__(CELLS, 2, bounds)

    def project(self, state: Any, coordinates: Any) -> None:
        """Write the position of `state` into `coordinates` [2]."""
        coordinates[0], coordinates[1] = state[0], state[1]

    def sampleFullState(self, sampler: Any, coordinates: Any, state: Any) -> None:
        """Draw a state at the position `coordinates` [2]."""
        sampler.sampleUniform(state)
        state[0], state[1] = coordinates[0], coordinates[1]


def grid_over(si: Any) -> Any:
    """Return a grid over the positions of an `ompl.control.SpaceInformation`.

    Raises:
        UnsupportedSpace: the state space is not a real-vector space of two dimensions or more.
        PlannerUnavailable: OMPL does not hear from Python where a state lies, so that all lie in one region.
    """
    space = si.getStateSpace()
    if not isinstance(space, ob.RealVectorStateSpace) or space.getDimension() < 2:
        raise UnsupportedSpace(f"a {type(space).__name__}: Syclop's grid expects a real-vector space of two "
                               "dimensions or more")
    whole = space.getBounds()
    bounds = ob.RealVectorBounds(2)
    for axis in (0, 1):
        bounds.setLow(axis, whole.low[axis])
        bounds.setHigh(axis, whole.high[axis])
    grid = PositionGrid(bounds)
    state, regions = si.allocState(), set()
    low, high = np.array(whole.low[:2]), np.array(whole.high[:2])
    for part in range(PROBES):
        state[0], state[1] = (low + (high - low) * (part + 0.5) / PROBES).tolist()
        regions.add(grid.locateRegion(state))
    if len(regions) < PROBES:
        raise PlannerUnavailable(f"the installed OMPL {version('ompl')} cannot run Syclop planners from "
                                 "Python: it does not hear where a decomposition projects a state; use Ex, "
                                 "RRT, EST or KPIECE1")
    return grid
