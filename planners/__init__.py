"""Planners that grow a tree: a strategy chooses nodes and controls, one OMPL planner does the rest.

Importing this package is light; OMPL and Numba come with the first planner.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planners.est_adapted import ESTAdapted
    from planners.ex import Ex
    from planners.random_walk import RandomWalk
    from planners.rrt_nh import RRTNH
    from planners.rrt_steered import RRTSteered
    from planners.strategy import Space, Strategy
    from planners.tree import Tree
    from planners.tree_planner import TreePlanner

__all__ = ["RRTNH", "ESTAdapted", "Ex", "RRTSteered", "RandomWalk", "Space", "Strategy", "Tree",
           "TreePlanner"]

_HOMES = {"ESTAdapted": "est_adapted", "Ex": "ex", "RandomWalk": "random_walk", "RRTNH": "rrt_nh",
          "RRTSteered": "rrt_steered", "Space": "strategy", "Strategy": "strategy", "Tree": "tree",
          "TreePlanner": "tree_planner"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
