"""OMPL's own control planners as registry entries, and what the installed OMPL cannot build of them.

OMPL draws from one random stream for the whole process: `build` seeds it, and equal seeds give equal paths
when the problem was built after the seeding too, as `pbcs_ompl.bridge` does.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

from ompl import control as oc
from ompl import util as ou

from pbcs_ompl.bridge.problem import quiet_ompl
from pbcs_ompl.core.errors import InvalidOption, PlannerUnavailable
from pbcs_ompl.planners.grid_decomposition import grid_over
from pbcs_ompl.planners.options import check_names, positive_integer


@dataclass(frozen=True)
class StockPlanner:
    """One of OMPL's planners (see core.interfaces.PlannerFactory).

    Attributes:
        name: The class in `ompl.control`.
        options: The setter and the default of each option; None leaves OMPL's own.
        decomposition: Makes the second argument of the constructor from the space information, if there is
            one.
    """

    name: str
    options: dict[str, tuple[str, Any]] = field(default_factory=dict)
    decomposition: Callable[[Any], Any] | None = None

    def build(self, si: Any, *, seed: int, **options: Any) -> Any:
        """Return a new planner on an `ompl.control.SpaceInformation`.

        Every planner has the option `hold`: OMPL holds each control for 1 to so many steps.

        Raises:
            PlannerUnavailable: the installed OMPL cannot build it.
            InvalidOption: it has no such option, at least in the installed OMPL, or refuses the value.
        """
        kind = getattr(oc, self.name, None)
        if kind is None:
            raise PlannerUnavailable(f"the installed OMPL {version('ompl')} has no {self.name} in Python")
        offered = {option: setter for option, (setter, _) in self.options.items() if hasattr(kind, setter)}
        check_names(self.name, options, [*offered, "hold"])
        hold = positive_integer("hold", options.get("hold", 1))
        with quiet_ompl():
            if hold > 1:
                si.setMinMaxControlDuration(1, hold)
            ou.RNG.setSeed(max(1, seed))
            planner = self._construct(kind, si)
            for option, setter in offered.items():
                value = options.get(option, self.options[option][1])
                if value is not None:
                    _set(planner, self.name, option, setter, value)
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
