"""Where the dimensions of a state vector lie in an OMPL state."""

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

Reader = Callable[[Any], list[float]]
Writer = Callable[[Any, Sequence[float]], None]


class Block(NamedTuple):
    """A run of consecutive state dimensions that is one real-vector space."""

    start: int
    stop: int
    explored: bool
    """Whether the dimensions are part of the feature."""


def blocks(state_size: int, feature_dims: tuple[int, ...] | None) -> list[Block]:
    """Cut the dimensions of a state into runs inside and outside the feature, in their own order.

    Because the order is kept, the subspaces of the OMPL state one after the other are the state vector.
    Without `feature_dims` the feature is not a selection of dimensions, and all of them are one run.
    """
    if feature_dims is None:
        return [Block(0, state_size, True)]
    explored = [dim in feature_dims for dim in range(state_size)]
    cuts = [dim for dim in range(1, state_size) if explored[dim] != explored[dim - 1]]
    return [Block(start, stop, explored[start])
            for start, stop in zip([0, *cuts], [*cuts, state_size], strict=True)]


def state_reader(parts: list[Block]) -> Reader:
    """Return a function from an OMPL state to the list of its D floats.

    OMPL states do not know their size and do not check indices: nothing but this and `state_writer` touches
    them.
    """
    if len(parts) == 1:
        return itemgetter(slice(0, parts[0].stop))
    inner = [(index, slice(0, part.stop - part.start)) for index, part in enumerate(parts)]

    def read(state: Any) -> list[float]:
        values: list[float] = []
        for index, whole in inner:
            values += state[index][whole]
        return values

    return read


def state_writer(parts: list[Block]) -> Writer:
    """Return a function that writes D floats into an OMPL state."""
    if len(parts) == 1:
        everything = slice(0, parts[0].stop)

        def write_vector(state: Any, values: Sequence[float]) -> None:
            state[everything] = values

        return write_vector
    moves = [(index, slice(0, part.stop - part.start), slice(part.start, part.stop))
             for index, part in enumerate(parts)]

    def write(state: Any, values: Sequence[float]) -> None:
        for index, whole, run in moves:
            state[index][whole] = values[run]

    return write


def control_reader(control_size: int) -> Reader:
    """Return a function from an OMPL control to the list of its A floats (controls know no slices)."""
    if control_size == 1:
        return lambda control: [control[0]]
    if control_size == 2:
        return lambda control: [control[0], control[1]]
    dims = range(control_size)
    return lambda control: list(map(control.__getitem__, dims))
