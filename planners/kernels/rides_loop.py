"""Rides: begin one, take note of each of its steps, and both in one compiled loop."""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.core.types import npy_rng
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.step_kernels import call_step
from pbcs_ompl.core.tree import Columns
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.planners.compiled import PARAMETERS_TYPE
from pbcs_ompl.planners.kernels.cells import cell_of, find_cell
from pbcs_ompl.planners.kernels.columns import COLUMNS_TYPE, finite
from pbcs_ompl.planners.kernels.memory import uncounted
from pbcs_ompl.planners.kernels.ranking import REGIONS, lift, lowest
from pbcs_ompl.planners.kernels.regions import REGIONS_TYPE, Regions, add_node, key_of, open_bin
from pbcs_ompl.planners.kernels.runs import Members, Number, Rows

SCALE, KIND, PATIENCE, ACTIVE, NODE, BIN, STEPS, DRY, KNOWN, GAINS = range(10)  # columns of `rides`; three questions
KINDS, PATIENCES = 2, 6  # uniform and surface controls; 1, 2, 4, ... 32 steps
OPENED, USED, WEIGHT = range(3)  # columns of `yields`
NO_BIN: Number = np.int64(-1)


class Limits(NamedTuple):
    """What ends a ride, beside its patience and the end of the episode."""

    steps: int
    """The most steps."""
    known: int = 2
    """Known bins in a row."""
    still: bool = True
    """Whether a step that does not change the state does."""


LIMITS_TYPE = types.NamedTuple((types.int64, types.int64, types.boolean), Limits)
_matrix = types.float64[:, ::1]
_vector = types.float64[::1]
_integers = types.int64[::1]


@njit(error_model="numpy")
def _draw(yields: Array, question: int, answers: int, uniform: float) -> int:
    """Return an answer with probability proportional to its weight."""
    total = 0.0
    for answer in range(answers):
        total += yields[question, answer, WEIGHT]
    rest = uniform * total
    for answer in range(answers - 1):
        rest -= yields[question, answer, WEIGHT]
        if rest < 0.0:
            return answer
    return answers - 1


@njit(error_model="numpy")
def _least_child(rows: Any, region: Number, uniform: float) -> Number:
    """Return a random one of the regions directly within one whose keys are lowest."""
    least, ties = np.int64(-1), 0
    child = np.int64(rows[region].child)
    while child >= 0:
        key = np.int64(key_of(rows, child))
        if least < 0 or key < least:
            least, ties = key, 1
        elif key == least:
            ties += 1
        child = rows[child].sibling
    left = int(uniform * ties)
    child = np.int64(rows[region].child)
    while True:
        if key_of(rows, child) == least:
            if left == 0:
                return child
            left -= 1
        child = rows[child].sibling


@njit(inline="always")
def _begin(rows: Any, order: Rows, runs: Any, tails: Rows, totals: NDArray[np.int64], pool: Members, yields: Array,
           bounds: Array, rides: IndexArray, actions: Array, ride: int, rng: np.random.Generator) -> None:
    """Choose scale, kind, patience, a region of few rides down to a bin, one of its nodes, and a control."""
    answers = (len(order), KINDS, PATIENCES)
    for question in range(len(answers)):  # by numbers that vary: functions are compiled for each constant
        rides[ride, question] = _draw(yields, question, answers[question], rng.random())
    scale = rides[ride, SCALE]
    region: Number = np.int64(lowest(order, runs, tails, scale, rng.random()))
    for _ in range(scale):
        region = _least_child(rows, region, rng.random())
    rides[ride, BIN] = region
    rides[ride, NODE] = pool[rows[region].start + int(rng.random() * rows[region].length)]
    level: Number = np.int64(0)
    while region >= 0:
        rows[region].count += 1  # at once, so that rides side by side begin elsewhere
        lift(order, runs, tails, totals, rows, level, region, key_of(rows, region))
        region = np.int64(rows[region].parent)
        level += 1
    largest = 0.0
    for axis in range(bounds.shape[1]):
        actions[ride, axis] = 2.0 * rng.random() - 1.0
        largest = max(largest, abs(actions[ride, axis]))
    for axis in range(bounds.shape[1]):
        low, high = bounds[0, axis], bounds[1, axis]
        unit = actions[ride, axis]
        if rides[ride, KIND] == 1 and largest > 0.0:
            unit /= largest
        actions[ride, axis] = min(max((low + high) / 2.0 + (high - low) / 2.0 * unit, low), high)
    rides[ride, ACTIVE] = 1
    rides[ride, STEPS] = rides[ride, DRY] = rides[ride, KNOWN] = rides[ride, GAINS] = 0


@njit(inline="always")
def _end(yields: Array, rides: IndexArray, ride: int) -> None:
    """End a ride: the weight of an answer is (bins opened / steps used with it)**4."""
    for question in (SCALE, KIND, PATIENCE):
        answer = rides[ride, question]
        yields[question, answer, OPENED] += rides[ride, GAINS]
        yields[question, answer, USED] += rides[ride, STEPS]
        squared = yields[question, answer, OPENED] / yields[question, answer, USED]
        squared *= squared
        yields[question, answer, WEIGHT] = squared * squared
    rides[ride, ACTIVE] = 0


@njit(inline="always")
def _note(rides: IndexArray, ride: int, yields: Array, states: Array, node: Number, number: Number, opened: bool,
            terminal: bool, limits: Limits) -> None:
    """Take note that a ride has come to a node, in bin `number` unless it is terminal; end the ride where it ends."""
    rides[ride, STEPS] += 1
    if terminal:
        _end(yields, rides, ride)
        return
    crossed = number != rides[ride, BIN]
    if opened:
        rides[ride, GAINS] += 1
        rides[ride, DRY] = rides[ride, KNOWN] = 0
    else:
        rides[ride, DRY] += 1
        rides[ride, KNOWN] += crossed
    moved = not limits.still
    for axis in range(states.shape[1]):
        moved = moved or states[node, axis] != states[rides[ride, NODE], axis]
    if (not moved or rides[ride, KNOWN] >= limits.known or rides[ride, DRY] >= 1 << rides[ride, PATIENCE]
            or rides[ride, STEPS] >= limits.steps):
        _end(yields, rides, ride)
    else:
        rides[ride, NODE], rides[ride, BIN] = node, number


@njit(error_model="numpy")
def begin(regions: Regions, yields: Array, bounds: Array, rides: IndexArray, actions: Array, count: int,
          rng: np.random.Generator) -> None:
    """Begin those of the first `count` rides that are not active."""
    regions = uncounted(regions)
    for ride in range(count):
        if rides[ride, ACTIVE] == 0:
            _begin(regions.rows, regions.order, regions.runs, regions.tails, regions.totals, regions.pool, yields,
                   bounds, rides, actions, ride, rng)


@njit(error_model="numpy")
def note(regions: Regions, yields: Array, rides: IndexArray, count: int, columns: Columns, first: int, last: int,
           bin_size: Array, limits: Limits) -> None:
    """Take note of the nodes first, ..., last - 1: roots, or what followed from the first `count` rides, in order.

    A ride from which nothing followed ends.
    """
    regions = uncounted(regions)
    states, features, _, parents, _, ends = uncounted(columns)
    cell, ride = regions.cell, 0
    for node in range(first, last):
        number, opened = NO_BIN, False
        if not ends[node]:
            cell_of(features, node, bin_size, regions.turns, cell)
            cell[len(bin_size)] = 0
            number = np.int64(regions.table[find_cell(regions.cells, regions.table, cell)]) - 1
            if number < 0:
                number, opened = open_bin(regions, cell), True
            add_node(regions.rows, regions.pool, regions.free, regions.used, number, node)
        if parents[node] < 0:
            continue
        while rides[ride, NODE] != parents[node]:
            _end(yields, rides, ride)
            ride += 1
        _note(rides, ride, yields, states, node, number, opened, ends[node], limits)
        ride += 1
    if last > first and parents[first] >= 0:
        for silent in range(ride, count):
            _end(yields, rides, silent)


@njit(types.Tuple((types.int64, types.boolean))(
    PARAMETERS_TYPE, _integers, _matrix, COLUMNS_TYPE, types.UniTuple(types.int64, 3), REGIONS_TYPE, _vector,
    LIMITS_TYPE, types.float64[:, :, ::1], types.int64[:, ::1], _matrix, npy_rng), error_model="numpy")
def explore(parameters: tuple[int, Array, Array, IndexArray], feature_dims: IndexArray, bounds: Array,
            columns: Columns, span: tuple[int, int, int], regions: Regions, bin_size: Array, limits: Limits,
            yields: Array, rides: IndexArray, actions: Array, rng: np.random.Generator) -> tuple[int, bool]:
    """Ride, one ride after the other, for as many steps as there is space, or until there is none to open a bin.

    Args:
        parameters: See `pbcs_ompl.planners.compiled.CompiledStep`.
        feature_dims: Dimensions of the state that are the feature [F].
        bounds: Lower and upper bounds of the controls [2, A].
        columns: The tree's arrays.
        span: The first node that is in no bin yet, the first that is not written yet, and one behind the last that may
            be. Those that are written are roots; to put them into their bins here saves the compilation of `note`.
        regions, bin_size: The regions, with space for all these nodes, for the bins of the roots and one more, and the
            edges of the bins [F].
        limits: What ends a ride.
        yields: Bins opened and steps used so far, and the weight [3, answers, 3], by scale, kind and patience.
        rides, actions: The first row of each is the ride in progress, and its control.
        rng: The random numbers.

    Returns:
        How many nodes were written, and whether the last one is the goal. A state that is not finite ends the loop
        as well; it is the last one and in no bin.
    """
    address, reals, table, integers = uncounted(parameters)
    states, features, controls, parents, rewards, ends = uncounted(columns)
    regions, yields, rides, actions = uncounted(regions), uncounted(yields), uncounted(rides), uncounted(actions)
    bounds, bin_size, feature_dims = uncounted(bounds), uncounted(bin_size), uncounted(feature_dims)
    rows, cells, places, order, runs, tails, totals, pool, free, used, cell, turns = regions
    known, first, end = span
    for child in range(known, end):
        if totals[REGIONS] + len(order) > len(rows):
            return child - first, False
        terminal, success = ends[child], False
        if child >= first:
            if rides[0, ACTIVE] == 0:
                _begin(rows, order, runs, tails, totals, pool, yields, bounds, rides, actions, 0, rng)
            node = rides[0, NODE]
            for axis in range(bounds.shape[1]):
                controls[child, axis] = actions[0, axis]
            reward, terminal, success = call_step(address, reals, table, integers, states, node, controls, child)
            for axis in range(len(feature_dims)):
                features[child, axis] = states[child, feature_dims[axis]]
            parents[child], rewards[child], ends[child] = node, reward, terminal
            if not finite(states, child):
                return child + 1 - first, False
        number, opened = NO_BIN, False
        if not terminal:
            cell_of(features, child, bin_size, turns, cell)
            cell[len(bin_size)] = 0
            number = np.int64(places[find_cell(cells, places, cell)]) - 1
            if number < 0:
                number, opened = open_bin(regions, cell), True
            add_node(rows, pool, free, used, number, child)
        if child >= first:
            _note(rides, 0, yields, states, child, number, opened, terminal, limits)
        if success:
            return child + 1 - first, True
    return end - first, False
