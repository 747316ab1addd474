"""The parts of OMPL's Python bindings that need care: numbers in states and controls, paths, the log, the seed.

OMPL's states and controls do not know their size and do not check indices: they are read and written here only. Import
this module only where OMPL is needed anyway.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from ompl import base as ob
from ompl import control as oc
from ompl import util as ou

from pbcs_ompl.core.errors import UnsupportedSpace
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, IndexArray

Reader = Callable[[Any], list[float]]
Writer = Callable[[Any, Sequence[float]], None]

VECTORS = (ob.RealVectorStateSpace, oc.RealVectorControlSpace)
COMPOUNDS = (ob.CompoundStateSpace, oc.CompoundControlSpace)


class RealPart(NamedTuple):
    """A real-vector space inside a space: the subspace indices that lead to it, and itself."""

    path: tuple[int, ...]
    space: Any


def real_parts(space: Any) -> list[RealPart]:
    """Return the real-vector spaces that a state or control space consists of, in order.

    Raises:
        UnsupportedSpace: a part of it is something else.
    """
    if isinstance(space, VECTORS):
        return [RealPart((), space)]
    if not isinstance(space, COMPOUNDS):
        raise UnsupportedSpace(f"a {type(space).__name__}: expected a real vector, or a compound of real vectors")
    return [RealPart((index, *part.path), part.space)
            for index in range(space.getSubspaceCount()) for part in real_parts(space.getSubspace(index))]


def real_dimension(space: Any) -> int:
    """Return how many floats a value of a state or control space has."""
    return sum(part.space.getDimension() for part in real_parts(space))


def real_bounds(space: Any) -> tuple[Array, Array]:
    """Return the lower and upper bounds of all floats of a state or control space."""
    boxes = [part.space.getBounds() for part in real_parts(space)]
    return np.array([low for box in boxes for low in box.low]), np.array([high for box in boxes for high in box.high])


def value_reader(space: Any) -> Reader:
    """Return a function from a state or control of `space` to the list of its floats; it holds no OMPL object."""
    parts = [(part.path, _vector_reader(part.space)) for part in real_parts(space)]
    if len(parts) == 1 and not parts[0][0]:
        return parts[0][1]

    def read(value: Any) -> list[float]:
        floats: list[float] = []
        for path, read_part in parts:
            part = value
            for index in path:
                part = part[index]
            floats += read_part(part)
        return floats

    return read


def value_writer(space: Any) -> Writer:
    """Return a function that writes all floats of a state or control of `space`; it holds no OMPL object."""
    parts, start = [], 0
    for path, vectors in real_parts(space):
        stop = start + vectors.getDimension()
        parts.append((path, slice(start, stop), _vector_writer(vectors)))
        start = stop
    if len(parts) == 1 and not parts[0][0]:
        return parts[0][2]

    def write(value: Any, floats: Sequence[float]) -> None:
        for path, run, write_part in parts:
            part = value
            for index in path:
                part = part[index]
            write_part(part, floats[run])

    return write


def _vector_reader(space: Any) -> Reader:
    """Return the reader of one vector; only states know slices, and these need their end."""
    size = space.getDimension()
    if isinstance(space, ob.RealVectorStateSpace):
        return itemgetter(slice(0, size))
    if size == 1:
        return lambda control: [control[0]]
    if size == 2:
        return lambda control: [control[0], control[1]]
    dims = range(size)
    return lambda control: [control[dim] for dim in dims]


def _vector_writer(space: Any) -> Writer:
    """Return the writer of one vector; two numbers are written faster one by one than as a slice."""
    size = space.getDimension()
    if size == 2:
        return _write_two
    if isinstance(space, oc.RealVectorControlSpace):
        return _write_each
    whole = slice(0, size)

    def write(state: Any, floats: Sequence[float]) -> None:
        state[whole] = floats

    return write


def _write_two(vector: Any, floats: Sequence[float]) -> None:
    vector[0], vector[1] = floats


def _write_each(vector: Any, floats: Sequence[float]) -> None:
    for dim, number in enumerate(floats):
        vector[dim] = number


def path_control(si: Any, states: Array, controls: Array, durations: IndexArray | None = None) -> Any:
    """Return the `ompl.control.PathControl` of arrays.

    Args:
        si: The `ompl.control.SpaceInformation`, whose spaces are made of real vectors.
        states: The states [T+1, D].
        controls: The controls [T, A].
        durations: How many propagation steps each control lasts [T]; None for one.
    """
    write_state, write_control = value_writer(si.getStateSpace()), value_writer(si.getControlSpace())
    path, state, control = oc.PathControl(si), si.allocState(), si.allocControl()
    seconds = si.getPropagationStepSize() * (np.ones(len(controls)) if durations is None else durations)
    # Tuples out of zip are freed one by one; a list for each state would wake the garbage collector.
    for values, action, duration in zip(zip(*states[:-1].T.tolist(), strict=True),
                                        zip(*controls.T.tolist(), strict=True), seconds.tolist(), strict=True):
        write_state(state, values)
        write_control(control, action)
        path.append(state, control, duration)
    write_state(state, states[-1].tolist())
    path.append(state)
    return path


def seed_ompl(seed: int) -> None:
    """Seed OMPL's random numbers for everything that is built from now on.

    OMPL claims that this comes too late in a process that has drawn numbers before. It does not, as long as every OMPL
    object is built afterwards; a test checks it. OMPL ignores the seed 0, hence the seed tree.
    """
    ou.RNG.setSeed(SeedTree(seed).child("ompl").integer())


@contextmanager
def quiet_ompl() -> Iterator[None]:
    """Keep OMPL from writing on stdout."""
    level = ou.getLogLevel()
    ou.setLogLevel(ou.LOG_NONE)
    try:
        yield
    finally:
        ou.setLogLevel(level)
