"""The tree that a planner has grown: from any OMPL planner, and as a file."""

from array import array
from pathlib import Path
from typing import Any

import numpy as np
from ompl import base as ob

from pbcs_ompl.bridge.planner_spec import as_batch_planner
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.ompl_access import real_dimension, value_reader
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.results.arrays import INTEGERS, take
from pbcs_ompl.results.files import read_arrays, write_arrays


def tree_of(planner: Any, space_information: Any) -> Tree:
    """Return the tree of a planner: its own, or what OMPL's PlannerData have of it.

    PlannerData carry no controls in the installed OMPL, and KPIECE1 keeps only some of the states it visited.
    """
    ours = as_batch_planner(planner)
    if ours is not None and ours.tree is not None:
        return ours.tree
    data = ob.PlannerData(space_information)
    planner.getPlannerData(data)
    read = value_reader(space_information.getStateSpace())
    size = data.numVertices()
    numbers, parent_of = array("d"), [-1] * size
    for node in range(size):
        numbers.extend(read(data.getVertex(node).getState()))
        for child in data.getEdges(node):  # asking for the incoming edges takes five times as long
            parent_of[child] = node
    states = np.frombuffer(numbers).reshape(size, real_dimension(space_information.getStateSpace()))
    return Tree.from_arrays(states, np.array(parent_of, dtype=np.int64))


def save_tree(tree: Tree, path: str | Path) -> None:
    """Write the states, parents and, where known, controls into one npz, atomically and without pickle.

    Raises:
        RunFolderError: the file cannot be written.
    """
    controls = {"controls": tree.controls} if tree.has_controls else {}
    write_arrays(Path(path), states=tree.states, parents=tree.parents, **controls)


def load_tree(path: str | Path) -> Tree:
    """Read what `save_tree` has written.

    Raises:
        DamagedFile: the file is missing, truncated, or not a tree.
    """
    path = Path(path)
    arrays = read_arrays(path)
    states = take(path, arrays, "states", (None, None), finite=False)
    parents = take(path, arrays, "parents", (len(states),), kinds=INTEGERS)
    if len(parents) and not -1 <= parents.min() <= parents.max() < len(states):
        raise DamagedFile(f"{path} is damaged: parents are nodes 0 to {len(states) - 1}, or -1")
    controls = take(path, arrays, "controls", (len(states), None), finite=False) if "controls" in arrays else None
    return Tree.from_arrays(states, parents, controls)
