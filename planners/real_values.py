"""OMPL states and controls that are made of real vectors, as flat lists of floats.

OMPL's values do not know their size and do not check indices: they are touched here only.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.core.errors import UnsupportedSpace

VECTORS = (ob.RealVectorStateSpace, oc.RealVectorControlSpace)
COMPOUNDS = (ob.CompoundStateSpace, oc.CompoundControlSpace)


class Leaf(NamedTuple):
    """A real-vector space inside a space: the subspace indices that lead to it, and itself."""

    path: tuple[int, ...]
    space: Any


def leaves(space: Any) -> list[Leaf]:
    """Return the real-vector spaces that a state or control space is made of, in order.

    Raises:
        UnsupportedSpace: a part of it is something else.
    """
    if isinstance(space, VECTORS):
        return [Leaf((), space)]
    if not isinstance(space, COMPOUNDS):
        raise UnsupportedSpace(f"a {type(space).__name__}: expected a real vector, or a compound of some")
    return [Leaf((index, *leaf.path), leaf.space)
            for index in range(space.getSubspaceCount()) for leaf in leaves(space.getSubspace(index))]


def read(parts: list[Leaf], value: Any) -> list[float]:
    """Return the floats of a state or control."""
    floats: list[float] = []
    for leaf in parts:
        part = _part(value, leaf.path)
        floats += [part[dim] for dim in range(leaf.space.getDimension())]
    return floats


def writer(parts: list[Leaf]) -> Callable[[Any, Sequence[float]], None]:
    """Return a function that writes as many floats as the space has dimensions into a state or control."""
    if len(parts) == 1 and parts[0].path == ():
        return _write_vector

    def write(value: Any, floats: Sequence[float]) -> None:
        first = 0
        for leaf in parts:
            last = first + leaf.space.getDimension()
            _write_vector(_part(value, leaf.path), floats[first:last])
            first = last

    return write


def _write_vector(vector: Any, floats: Sequence[float]) -> None:
    for dim, number in enumerate(floats):
        vector[dim] = number


def bounds(parts: list[Leaf]) -> tuple[list[float], list[float]]:
    """Return the lower and upper bounds of all floats."""
    boxes = [leaf.space.getBounds() for leaf in parts]
    return [low for box in boxes for low in box.low], [high for box in boxes for high in box.high]


def _part(value: Any, path: tuple[int, ...]) -> Any:
    for index in path:
        value = value[index]
    return value
