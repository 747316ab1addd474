"""Planners that grow a tree: a strategy chooses nodes and controls, one OMPL planner does the rest.

Importing this package is light; OMPL and Numba come with the first planner.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbcs_ompl.core.tree import Tree
    from pbcs_ompl.planners.context import PlanningContext
    from pbcs_ompl.planners.est_adapted import ESTAdapted
    from pbcs_ompl.planners.est_compiled import ESTCompiled
    from pbcs_ompl.planners.ex import Ex
    from pbcs_ompl.planners.kpiece_compiled import KPIECE1Compiled
    from pbcs_ompl.planners.planner import Strategy, TreePlanner
    from pbcs_ompl.planners.random_walk import RandomWalk
    from pbcs_ompl.planners.rides import Rides
    from pbcs_ompl.planners.rides_sst import RidesSST
    from pbcs_ompl.planners.rrt_compiled import RRTCompiled
    from pbcs_ompl.planners.rrt_nh import RRTNH
    from pbcs_ompl.planners.rrt_steered import RRTSteered
    from pbcs_ompl.planners.sst_compiled import SSTCompiled

__all__ = ["RRTNH", "ESTAdapted", "ESTCompiled", "Ex", "KPIECE1Compiled", "PlanningContext", "RRTCompiled",
           "RRTSteered", "RandomWalk", "Rides", "RidesSST", "SSTCompiled", "Strategy", "Tree", "TreePlanner"]

_MODULES = {"ESTAdapted": "planners.est_adapted", "ESTCompiled": "planners.est_compiled",
            "KPIECE1Compiled": "planners.kpiece_compiled", "RRTCompiled": "planners.rrt_compiled",
            "SSTCompiled": "planners.sst_compiled",
            "Ex": "planners.ex", "PlanningContext": "planners.context",
            "RandomWalk": "planners.random_walk", "Rides": "planners.rides", "RidesSST": "planners.rides_sst",
            "RRTNH": "planners.rrt_nh",
            "RRTSteered": "planners.rrt_steered",
            "Strategy": "planners.planner", "Tree": "core.tree", "TreePlanner": "planners.planner"}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"pbcs_ompl.{_MODULES[name]}"), name)


if __name__ == "planners":  # the folder of a checkout, imported by its own name
    from pbcs_ompl.core.alias import alias_package

    alias_package("planners", "pbcs_ompl.planners")
