"""Planners that grow a tree: a strategy chooses nodes and controls, one OMPL planner does the rest.

Importing this package is light; OMPL and Numba come with the first planner.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbcs_ompl.planners.est_adapted import ESTAdapted
    from pbcs_ompl.planners.ex import Ex
    from pbcs_ompl.planners.random_walk import RandomWalk
    from pbcs_ompl.planners.rrt_nh import RRTNH
    from pbcs_ompl.planners.rrt_steered import RRTSteered
    from pbcs_ompl.planners.strategy import Space, Strategy
    from pbcs_ompl.planners.tree import Tree
    from pbcs_ompl.planners.tree_planner import TreePlanner

__all__ = ["RRTNH", "ESTAdapted", "Ex", "RRTSteered", "RandomWalk", "Space", "Strategy", "Tree",
           "TreePlanner"]

_HOMES = {"ESTAdapted": "est_adapted", "Ex": "ex", "RandomWalk": "random_walk", "RRTNH": "rrt_nh",
          "RRTSteered": "rrt_steered", "Space": "strategy", "Strategy": "strategy", "Tree": "tree",
          "TreePlanner": "tree_planner"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)

if __name__ == "planners":  # the folder of a checkout, imported by its own name
    from pbcs_ompl.core.alias import alias_package

    alias_package("planners", "pbcs_ompl.planners")
