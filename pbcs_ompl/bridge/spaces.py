"""The environment as OMPL spaces: distance and projection speak of the feature, states stay complete."""

from typing import Any, NamedTuple

import numpy as np
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import value_reader
from pbcs_ompl.core.types import Array


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


def make_state_space(model: ResettableModel) -> Any:
    """Return the state space of a model, with the feature as its default projection.

    When the feature is a selection of the state's dimensions, the others have weight 0: distances between
    states, and so nearest neighbours, are distances between features ([Matheron2020] 3.4.2). Subspaces keep
    the order of the state vector. A feature that is not one run of dimensions makes several subspaces of
    weight 1, whose distances OMPL adds.

    When the feature is computed (`feature_dims` is None), distances are those of the whole state, because
    OMPL's metric cannot be replaced from Python; the projection is still the feature.
    """
    parts = blocks(len(model.state_low), model.feature_dims)
    spaces = [_box(model.state_low[part.start:part.stop], model.state_high[part.start:part.stop])
              for part in parts]
    space = spaces[0]
    if len(parts) > 1:
        space = ob.CompoundStateSpace()
        for subspace, part in zip(spaces, parts, strict=True):
            space.addSubspace(subspace, 1.0 if part.explored else 0.0)
        space.lock()
    space.registerDefaultProjection(_projection(space, spaces, parts, model))
    return space


def make_control_space(state_space: Any, model: ResettableModel) -> Any:
    """Return the control space of a model: the box of its actions."""
    space = oc.RealVectorControlSpace(state_space, len(model.action_low))
    space.setBounds(_bounds(model.action_low, model.action_high))
    return space


class FeatureProjection(ob.ProjectionEvaluator):  # type: ignore[misc] # OMPL's classes have no types
    """The projection of a state on a feature that OMPL's own evaluators cannot express."""

    def __init__(self, space: Any, model: ResettableModel):
        super().__init__(space)
        self._read = value_reader(space)
        self._feature = model.feature
        self._size = len(model.bin_size)
        self.inferCellSizes()  # OMPL refuses to set the size of a cell before it has guessed one
        for dim, size in enumerate(model.bin_size):
            self.setCellSizes(dim, float(size))

    def getDimension(self) -> int:
        """Return the number of feature dimensions F."""
        return self._size

    def project(self, state: Any, projection: Array) -> None:
        """Write the feature of `state` into `projection` [F]."""
        projection[:] = self._feature(np.array([self._read(state)]))[0]


def _projection(space: Any, spaces: list[Any], parts: list[Block], model: ResettableModel) -> Any:
    cells = [float(size) for size in model.bin_size]
    explored = [index for index, part in enumerate(parts) if part.explored]
    if model.feature_dims is None or len(explored) > 1:
        return FeatureProjection(space, model)
    (index,) = explored
    dims = [dim - parts[index].start for dim in model.feature_dims]
    projection = ob.RealVectorOrthogonalProjectionEvaluator(spaces[index], cells, dims)
    return projection if len(parts) == 1 else ob.SubspaceProjectionEvaluator(space, index, projection)


def _box(low: Array, high: Array) -> Any:
    space = ob.RealVectorStateSpace(len(low))
    space.setBounds(_bounds(low, high))
    return space


def _bounds(low: Array, high: Array) -> Any:
    bounds = ob.RealVectorBounds(len(low))
    for dim, (least, most) in enumerate(zip(low, high, strict=True)):
        bounds.setLow(dim, float(least))
        bounds.setHigh(dim, float(most))
    return bounds
