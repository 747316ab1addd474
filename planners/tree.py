"""The tree that a planner grows, as arrays."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.types import Array, BoolArray, IndexArray

GROWTH = 4
"""Rooms that nobody has written to cost address space, but no memory; copies cost both memory and time."""
FIRST_ROOM = 1 << 14
MOST_RESERVED = 1 << 30
"""Bytes of address space that a tree may ask for in advance."""


class Columns(NamedTuple):
    """The arrays of a tree with room for R >= N nodes; what lies beyond the N nodes means nothing."""

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
        state_size, control_size: D and A.
        feature_size: F, or None where the state is the feature.
        expected: How many nodes there may be, if that is known: address space is reserved for them.
    """

    def __init__(self, state_size: int, control_size: int, feature_size: int | None = None, *,
                 expected: int = 0):
        node_bytes = 8 * (state_size + (feature_size or 0) + control_size) + 13
        room = max(FIRST_ROOM, min(expected, MOST_RESERVED // node_bytes))
        states = np.empty((room, state_size))
        features = states if feature_size is None else np.empty((room, feature_size))
        self.columns = Columns(states, features, np.empty((room, control_size)), np.empty(room, np.int32),
                               np.empty(room), np.empty(room, np.bool_))
        self._size = 0

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
        """The control [N, A] that led from the parent; 0 for a root."""
        return self.columns.controls[:self._size]

    @property
    def parents(self) -> NDArray[np.int32]:
        """The parent of each node [N]; -1 for a root."""
        return self.columns.parents[:self._size]

    @property
    def rewards(self) -> Array:
        """The reward [N] of the transition from the parent; 0 for a root."""
        return self.columns.rewards[:self._size]

    @property
    def terminal(self) -> BoolArray:
        """Which nodes end an episode [N]; they have no children."""
        return self.columns.terminal[:self._size]

    @property
    def nbytes(self) -> int:
        """Bytes of the nodes; rooms that were never written to are not counted."""
        distinct = {id(column): column for column in self.columns}.values()
        return sum(column[:self._size].nbytes for column in distinct)

    def append(self, states: Array, parents: Any, controls: Array | float, rewards: Array | float,
               terminal: BoolArray | bool, features: Array | None = None) -> None:
        """Add B nodes: states [B, D], ..., features [B, F]; no features where the states are them."""
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
        """Make room for `count` more nodes."""
        needed = self._size + count
        if needed <= len(self.columns.parents):
            return
        room = max(needed, GROWTH * len(self.columns.parents))
        distinct = {id(column): column for column in self.columns}
        larger = {key: _enlarged(column, self._size, room) for key, column in distinct.items()}
        self.columns = Columns(*(larger[id(column)] for column in self.columns))

    def claim(self, count: int) -> None:
        """Count in `count` nodes that were written into the columns behind the last one."""
        self._size += count

    def path_to(self, node: int) -> IndexArray:
        """Return the nodes from a root to `node`, both included."""
        parents = self.columns.parents
        path = [int(node)]
        while parents[path[-1]] >= 0:
            path.append(int(parents[path[-1]]))
        return np.array(path[::-1], dtype=np.int64)


def _enlarged(column: np.ndarray, used: int, room: int) -> np.ndarray:
    larger = np.empty((room, *column.shape[1:]), column.dtype)
    larger[:used] = column[:used]
    return larger
