"""Environments seen as functions of states: one adapter for each family, and a check for their authors.

Example:
    >>> from pbcs_ompl.resettable import make
    >>> model = make("pbcs/Maze-v0", {"size": 5})
    >>> state = model.initial_state()
"""

from pbcs_ompl.resettable.adapt import adapt
from pbcs_ompl.resettable.check import Check, ResetReport, check_resettable
from pbcs_ompl.resettable.make import make

__all__ = ["Check", "ResetReport", "adapt", "check_resettable", "make"]
