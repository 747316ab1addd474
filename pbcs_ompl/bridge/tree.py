"""The tree that a planner has grown, as arrays."""

from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from ompl import base as ob

from pbcs_ompl.bridge.layout import blocks, state_reader
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.results.folder import read_arrays, write_arrays


@runtime_checkable
class Tree(Protocol):
    """The arrays of a tree: states [N, D], parents [N] and controls [N, A]."""

    @property
    def states(self) -> Array: ...
    @property
    def parents(self) -> IndexArray: ...
    @property
    def controls(self) -> Array: ...


@runtime_checkable
class HoldsTree(Protocol):
    """A planner that keeps its tree, perhaps as arrays."""

    @property
    def tree(self) -> Any: ...


@dataclass(frozen=True, eq=False)
class TreeArrays:
    """A tree of states.

    Attributes:
        states: The nodes' states [N, D].
        parents: The index of each node's parent [N]; -1 for a root.
        controls: The control [N, A] that led from the parent (0 for a root); None where the planner does
            not tell.
    """

    states: Array
    parents: IndexArray
    controls: Array | None

    def save(self, path: str | Path) -> None:
        """Write one npz, atomically and without pickle."""
        controls = {} if self.controls is None else {"controls": self.controls}
        write_arrays(Path(path), states=self.states, parents=self.parents, **controls)

    @classmethod
    def load(cls, path: str | Path) -> "TreeArrays":
        """Read what `save` has written.

        Raises:
            DamagedFile: the file is missing, truncated, or not a tree.
        """
        arrays = read_arrays(Path(path))
        if not {"states", "parents"} <= set(arrays) or arrays["states"].shape[:1] != arrays["parents"].shape:
            raise DamagedFile(f"{path} is not a tree: expected states [N, D] and parents [N]")
        return cls(arrays["states"], arrays["parents"], arrays.get("controls"))


def tree_of(planner: Any, model: ResettableModel, space_information: Any) -> TreeArrays:
    """Return the tree of a planner: its own arrays, or what OMPL's PlannerData tell.

    PlannerData carry no controls in the installed OMPL, and KPIECE1 keeps only some of the states it visited.
    """
    if isinstance(planner, HoldsTree) and isinstance(tree := planner.tree, Tree):
        parents = np.array(tree.parents, dtype=np.int64)
        return TreeArrays(np.array(tree.states), parents, np.array(tree.controls))
    data = ob.PlannerData(space_information)
    planner.getPlannerData(data)
    read = state_reader(blocks(len(model.state_low), model.feature_dims))
    size = data.numVertices()
    numbers, parent_of = array("d"), [-1] * size
    for node in range(size):
        numbers.extend(read(data.getVertex(node).getState()))
        for child in data.getEdges(node):  # asking for the incoming edges takes five times as long
            parent_of[child] = node
    states = np.frombuffer(numbers).reshape(size, len(model.state_low))
    return TreeArrays(states, np.array(parent_of, dtype=np.int64), None)
