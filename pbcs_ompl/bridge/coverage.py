"""How much of the feature space a search has seen after how many transitions."""

from array import array
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray

Step = Callable[[list[float], list[float]], list[float]]
POINTS_PER_DECADE = 10
MOST_CELLS = 1 << 20


@dataclass(frozen=True, eq=False)
class Coverage:
    """The share of the cells of the feature space that a search has been in, as it grew.

    The cells cut the box of the features into the bins that the environment suggests; where these were more than a
    million, their edges are doubled until they are not. A cell counts once a transition has ended in it. The share is
    the extent of [Matheron2020] 3.2, the part of the space that is closer than eps to the tree, in the maximum norm,
    with eps half an edge, measured at the centres of the cells. Where walls fill whole cells, 1 is out of reach.

    Attributes:
        transitions: Numbers of transitions [K]: 1, 2, 3, 4, 5, 6, 8, 10, ..., ten a decade, and the last one.
        seconds: Wall time of the search at each of them [K].
        share: The share of the cells at each of them [K], from 0 to 1.
    """

    transitions: IndexArray
    seconds: Array
    share: Array


class TransitionRecorder:
    """Records what a planner does, so that its coverage can be computed afterwards.

    A tree that has a node for every transition lacks only the times. OMPL's own planners keep fewer nodes, or in
    another order; for them every state that the propagator produces is copied (8 bytes a dimension).
    """

    def __init__(self, model: ResettableModel):
        self._model = model
        self._values = array("d")
        self._counts, self._seconds = [0], [0.0]

    def recording(self, step: Step) -> Step:
        """Return `step` that also copies every state it produces."""
        copy = self._values.extend

        def recorded(state: list[float], control: list[float]) -> list[float]:
            reached = step(state, control)
            copy(reached or state)
            return reached

        return recorded

    def timed(self, stop: Callable[[], bool], counter: Counter) -> Callable[[], bool]:
        """Return `stop`, which a planner polls, that also records the time, about ten times a decade of transitions."""
        began, due = perf_counter(), 1.0

        def timed_stop() -> bool:
            nonlocal due
            if counter.count >= due:
                self._counts.append(counter.count)
                self._seconds.append(perf_counter() - began)
                due = counter.count * 10 ** (1 / POINTS_PER_DECADE)
            return stop()

        return timed_stop

    def coverage(self, tree: Tree, transitions: int, seconds: float) -> Coverage | None:
        """Return the coverage of a search that has ended; None when its states are not known one by one.

        Args:
            tree: The tree that the planner has grown.
            transitions, seconds: What the search took.
        """
        states = np.frombuffer(self._values).reshape(-1, len(self._model.state_low))
        if len(states) != transitions:
            states = tree.states[tree.parents >= 0]
        if len(states) != transitions:
            return None
        points = log_spaced(transitions)
        times = np.interp(points, [*self._counts, transitions], [*self._seconds, seconds])
        times = np.minimum(times, seconds)  # the clock of the marks starts a moment earlier
        return Coverage(points, times, _shares(self._model, states, points))


def log_spaced(most: int) -> IndexArray:
    """Return the whole numbers closest to 10^(k / 10), from 1 to `most`, and `most`; none when it is 0."""
    exponents = np.arange(POINTS_PER_DECADE * np.log10(max(most, 1)) + 1e-9)
    points = np.append(np.round(10 ** (exponents / POINTS_PER_DECADE)), most).astype(np.int64)
    return np.unique(points[(points > 0) & (points <= most)])


def _shares(model: ResettableModel, states: Array, points: IndexArray) -> Array:
    """Return the share of the cells that the first `points` [K] of the states [N, D] lie in [K]."""
    edges = np.array(model.bin_size)
    while np.prod(shape := _cells_per_axis(model, edges)) > MOST_CELLS:
        edges *= 2.0
    whole = model.feature_dims is None
    columns = np.array(range(len(edges)) if model.feature_dims is None else model.feature_dims, dtype=np.int64)
    table = np.ascontiguousarray(model.feature(states) if whole else states)
    seen = np.zeros(int(np.prod(shape)), dtype=np.bool_)
    return _count_cells(table, columns, model.feature_low, edges, shape, points, seen) / len(seen)


def _cells_per_axis(model: ResettableModel, edges: Array) -> IndexArray:
    numbers = (model.feature_high - model.feature_low) / edges
    return np.maximum(1, np.ceil(numbers - 1e-9)).astype(np.int64)


@njit()
def _count_cells(states: Array, columns: IndexArray, low: Array, edges: Array, shape: IndexArray,
                 points: IndexArray, seen: BoolArray) -> IndexArray:
    """Return how many cells the first `points` [K] rows of states [N, D] lie in [K], by the dimensions `columns` [F].

    Args:
        low, edges, shape: The lower corner of the grid, the edges of its cells and their number on each axis [F].
        seen: A flag for every cell, false at first. States beyond the grid count in its outermost cells.
    """
    counts = np.empty(len(points), np.int64)
    cells, row = 0, 0
    for k in range(len(points)):
        while row < points[k]:
            index = 0
            for axis in range(len(columns)):
                place = int((states[row, columns[axis]] - low[axis]) / edges[axis])
                index = index * shape[axis] + min(max(place, 0), shape[axis] - 1)
            if not seen[index]:
                seen[index] = True
                cells += 1
            row += 1
        counts[k] = cells
    return counts
