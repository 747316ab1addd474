"""The tree of states that a planner grows, as arrays."""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.types import Array, BoolArray, IndexArray

GROWTH = 4
"""Rows that were never written to cost address space, but no memory; copies cost both memory and time."""
FIRST_ROWS = 1 << 14
MOST_RESERVED = 1 << 31
"""Bytes of address space that a tree may reserve in advance."""


class Columns(NamedTuple):
    """The arrays of a tree with R >= N rows; what lies beyond the N nodes means nothing."""

    states: Array
    """[R, D]"""
    features: Array
    """[R, F]; the same array as `states` where a state is its own feature."""
    controls: Array
    """[R, A]"""
    parents: NDArray[np.int32]
    rewards: Array
    terminal: BoolArray


class Tree:
    """Nodes 0 .. N-1 in the order of their insertion; parents come before children, roots have the parent -1.

    Its arrays are views: they show the nodes that were there when they were asked for.

    Args:
        state_size: D.
        control_size: A; 0 for the tree of a planner that does not report its controls.
        feature_size: F, or None where the state is the feature.
        expected: How many nodes there may be, if that is known: once there are many, address space is reserved for
            all. Before that it would be slow, because Linux clears new memory in huge pages, one for each array.
    """

    def __init__(self, state_size: int, control_size: int, feature_size: int | None = None, *,
                 expected: int = 0):
        node_bytes = 8 * (state_size + (feature_size or 0) + control_size) + 13
        self._expected = min(expected, MOST_RESERVED // node_bytes)
        states = np.empty((FIRST_ROWS, state_size))
        features = states if feature_size is None else np.empty((FIRST_ROWS, feature_size))
        self.columns = Columns(states, features, np.empty((FIRST_ROWS, control_size)), np.empty(FIRST_ROWS, np.int32),
                               np.empty(FIRST_ROWS), np.empty(FIRST_ROWS, np.bool_))
        self._size = 0

    @classmethod
    def from_arrays(cls, states: Array, parents: NDArray[Any], controls: Array | None = None) -> Self:
        """Return a tree of which only this is known: its rewards are NaN and no node is terminal.

        Args:
            states: The nodes' states [N, D].
            parents: The parent of each node [N]; -1 for a root. They may come after their children.
            controls: The control [N, A] that led from the parent; None where unknown.
        """
        known = np.empty((len(states), 0)) if controls is None else controls
        tree = cls(states.shape[1], known.shape[1])
        tree.append(states, parents, known, np.nan, False)
        return tree

    def __len__(self) -> int:
        return self._size

    @property
    def states(self) -> Array:
        """States [N, D]."""
        return self.columns.states[:self._size]

    @property
    def features(self) -> Array:
        """Features [N, F]."""
        return self.columns.features[:self._size]

    @property
    def controls(self) -> Array:
        """The control [N, A] that led from the parent; 0 for a root, [N, 0] where the planner reports none."""
        return self.columns.controls[:self._size]

    @property
    def has_controls(self) -> bool:
        """Whether the planner reports its controls."""
        return bool(self.columns.controls.shape[1] > 0)

    @property
    def parents(self) -> NDArray[np.int32]:
        """The parent of each node [N]; -1 for a root."""
        return self.columns.parents[:self._size]

    @property
    def rewards(self) -> Array:
        """The reward [N] of the transition from the parent; 0 for a root, NaN where unknown."""
        return self.columns.rewards[:self._size]

    @property
    def terminal(self) -> BoolArray:
        """Which nodes end an episode [N]; they have no children."""
        return self.columns.terminal[:self._size]

    @property
    def nbytes(self) -> int:
        """Bytes of the nodes; rows that were never written to are not counted."""
        distinct = {id(column): column for column in self.columns}.values()
        return sum(column[:self._size].nbytes for column in distinct)

    def append(self, states: Array, parents: Any, controls: Array | float, rewards: Array | float,
               terminal: BoolArray | bool, features: Array | None = None) -> None:
        """Add B nodes.

        Args:
            states: Their states [B, D].
            parents: Their parents [B], or one for all.
            controls, rewards, terminal: The controls [B, A], rewards [B] and ends [B] of the transitions to them.
            features: Their features [B, F]; None where the states are the features.
        """
        count = len(states)
        self.reserve(count)
        new = slice(self._size, self._size + count)
        columns = self.columns
        columns.states[new] = states
        if features is not None:
            columns.features[new] = features
        columns.controls[new] = controls
        columns.parents[new] = parents
        columns.rewards[new] = rewards
        columns.terminal[new] = terminal
        self._size += count

    def reserve(self, count: int) -> None:
        """Allocate space for `count` more nodes."""
        needed = self._size + count
        if needed > len(self.columns.parents):
            self.columns = self._resized(max(needed, self._expected, GROWTH * len(self.columns.parents)))

    def claim(self, count: int) -> None:
        """Count in `count` nodes that were written into the columns behind the last one."""
        self._size += count

    def path_to(self, node: int) -> IndexArray:
        """Return the nodes from a root to `node`, both included."""
        parents, path, node = self.columns.parents.data, [], int(node)
        while node >= 0:
            path.append(node)
            node = parents[node]
        return np.array(path[::-1], dtype=np.int64)

    def __getstate__(self) -> dict[str, Any]:
        """Return the nodes without the reserved rows, for pickle."""
        return {"columns": self._resized(self._size), "_size": self._size, "_expected": 0}

    def _resized(self, rows: int) -> Columns:
        distinct = {id(column): column for column in self.columns}
        resized = {key: resized_copy(column, self._size, rows) for key, column in distinct.items()}
        return Columns(*(resized[id(column)] for column in self.columns))


def resized_copy(array: NDArray[Any], used: int, rows: int) -> NDArray[Any]:
    """Return an array of `rows` rows whose first `used` rows are those of `array`."""
    copy = np.empty((rows, *array.shape[1:]), array.dtype)
    copy[:used] = array[:used]
    return copy
