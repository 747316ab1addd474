"""OMPL's own control planners as registry entries, and what the installed OMPL cannot build of them.

OMPL draws from one random stream for the whole process: `build` seeds it, and equal seeds give equal paths
when the problem was built after the seeding too, as `pbcs_ompl.plan` does.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import control as oc
from ompl import util as ou

from pbcs_ompl.core.errors import InvalidOption, PlannerUnavailable, UnsupportedSpace
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.options import check_control_duration, check_names

GRID_CELLS = 32
GRID_PROBES = 16


@dataclass(frozen=True)
class StockPlanner:
    """One of OMPL's planners (see core.interfaces.PlannerFactory).

    Attributes:
        name: The class in `ompl.control`.
        setters: The setter and the default of each option; None leaves OMPL's own.
        decomposition: Makes the second argument of the constructor from the space information, if there is
            one.
    """

    name: str
    setters: dict[str, tuple[str, Any]] = field(default_factory=dict)
    decomposition: Callable[[Any], Any] | None = None

    def options(self) -> dict[str, Any]:
        """Return the options that the installed OMPL offers, with their defaults.

        `control_duration` is the most steps that a control lasts, or the least and the most, all equally likely.
        """
        offered = dir(oc.__dict__.get(self.name))
        own = {option: default for option, (setter, default) in self.setters.items() if setter in offered}
        return {**own, "control_duration": 1}

    def build(self, si: Any, *, seed: int, **options: Any) -> Any:
        """Return a new planner on an `ompl.control.SpaceInformation`.

        Args:
            si: The problem.
            seed: The seed of OMPL's random numbers.
            options: See `options`.

        Raises:
            PlannerUnavailable: the installed OMPL cannot build it.
            InvalidOption: it has no such option, at least in the installed OMPL, or refuses the value.
        """
        kind = oc.__dict__.get(self.name)
        if kind is None:
            raise PlannerUnavailable(f"the installed OMPL {version('ompl')} has no {self.name} in Python")
        check_names(f"planner {self.name!r}", "option", options, self.options())
        values = {**self.options(), **options}
        least, most = check_control_duration(values.pop("control_duration"))
        with quiet_ompl():
            if most > 1:
                si.setMinMaxControlDuration(least, most)
            ou.RNG.setSeed(max(1, seed))
            planner = self._construct(kind, si)
            for option, value in values.items():
                if value is not None:
                    _set(planner, self.name, option, self.setters[option][0], value)
        return planner

    def _construct(self, kind: Any, si: Any) -> Any:
        try:
            return kind(si) if self.decomposition is None else kind(si, self.decomposition(si))
        except TypeError as error:
            reason = str(error).splitlines()[0]
            raise PlannerUnavailable(f"the installed OMPL {version('ompl')} cannot build {self.name} from "
                                     f"Python: {reason}; use Ex, RRT, EST or KPIECE1") from error


def _set(planner: Any, name: str, option: str, setter: str, value: Any) -> None:
    try:
        getattr(planner, setter)(value)
    except TypeError as error:
        reason = str(error).splitlines()[0]
        raise InvalidOption(f"planner {name!r} refused {option}={value!r}: {reason}") from error


class PositionGrid(oc.GridDecomposition):  # type: ignore[misc] # OMPL's classes have no types
    """The grid that OMPL's Syclop planners need, over the first two dimensions of a real-vector state space."""

    def __init__(self, bounds: Any):
        super().__init__(GRID_CELLS, 2, bounds)

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
        PlannerUnavailable: OMPL does not call `project` of a Python class, so that all states lie in one region.
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
    for part in range(GRID_PROBES):
        state[0], state[1] = (low + (high - low) * (part + 0.5) / GRID_PROBES).tolist()
        regions.add(grid.locateRegion(state))
    if len(regions) < GRID_PROBES:
        raise PlannerUnavailable(f"the installed OMPL {version('ompl')} cannot run Syclop planners from "
                                 "Python: its binding does not call GridDecomposition.project; use Ex, RRT, EST or "
                                 "KPIECE1")
    return grid


RRT = StockPlanner("RRT", {
    "goal_bias": ("setGoalBias", 0.0), "intermediate_states": ("setIntermediateStates", False)})
"""Without goal bias, OMPL's default here, it is [Matheron2020] Alg. 3: nearest node, one random control."""
EST = StockPlanner("EST", {"goal_bias": ("setGoalBias", None), "range": ("setRange", None)})
KPIECE1 = StockPlanner("KPIECE1", {
    "goal_bias": ("setGoalBias", None), "border_fraction": ("setBorderFraction", None),
    "max_close_samples": ("setMaxCloseSamplesCount", None)})
SST = StockPlanner("SST", {
    "goal_bias": ("setGoalBias", None), "selection_radius": ("setSelectionRadius", None),
    "pruning_radius": ("setPruningRadius", None)})
PDST = StockPlanner("PDST", {"goal_bias": ("setGoalBias", None)})
SyclopRRT = StockPlanner("SyclopRRT", decomposition=grid_over)
SyclopEST = StockPlanner("SyclopEST", decomposition=grid_over)
