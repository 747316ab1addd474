"""What strategies share that repeat OMPL's own planners: a control of several steps is a motion."""

from typing import Any

import numpy as np

from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray


def ends_of(tree: Tree, first: int, last: int) -> IndexArray:
    """Return which of the new nodes first, ..., last - 1 end a motion and can be expanded."""
    ends = np.ones(last - first, np.bool_)
    parents = tree.parents[first:last]
    ends[parents[parents >= first] - first] = False
    return first + np.flatnonzero(ends & ~tree.terminal[first:last])


def motions_of(tree: Tree, first: int, last: int) -> list[list[int]]:
    """Return the new nodes first, ..., last - 1 motion by motion; a root is one by itself."""
    motions: list[list[int]] = []
    of: dict[int, list[int]] = {}
    for node, parent in enumerate(tree.parents[first:last].tolist(), first):
        motion = of.get(parent)
        if motion is None:
            motions.append(motion := [])
        motion.append(node)
        of[node] = motion
    return motions


def bounds_of(context: Any) -> Array:
    """Return the lower and upper bounds of the controls [2, A]."""
    return np.array([context.action_low, context.action_high])
