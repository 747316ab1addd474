"""Laws of the spaces: what is written is read, distance is the feature's, the projection is the feature."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ompl import base as ob

from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.spaces import blocks, make_state_space
from pbcs_ompl.core.ompl_access import value_reader, value_writer
from pbcs_ompl.core.types import Counter


@given(st.lists(st.booleans(), min_size=1, max_size=8).filter(any))
def test_blocks_cover_the_state_in_order(explored):
    size, dims = len(explored), {dim for dim, inside in enumerate(explored) if inside}
    parts = blocks(size, tuple(dims))
    assert [dim for part in parts for dim in range(part.start, part.stop)] == list(range(size))
    assert {dim for part in parts if part.explored for dim in range(part.start, part.stop)} == dims


def test_what_is_written_is_read(any_square):
    rng = np.random.default_rng(0)
    with make_problem(any_square, counter=Counter()) as problem:
        space = problem.setup.getStateSpace()
        state, other = (problem.space_information.allocState() for _ in range(2))
        for _ in range(20):
            values = rng.uniform(0, 5, len(any_square.state_low)).tolist()
            value_writer(space)(state, values)
            problem.space_information.copyState(other, state)
            assert value_reader(space)(other) == values


@pytest.mark.parametrize("dims", [(0, 1), (1, 2), (2, 1)])
def test_distance_is_between_features(square, dims):
    model = square(size=5, feature_dims=dims)
    with make_problem(model, counter=Counter()) as problem:
        write = value_writer(problem.setup.getStateSpace())
        information = problem.space_information
        one, two = information.allocState(), information.allocState()
        values = np.random.default_rng(1).uniform(0, 5, (2, 5))
        write(one, values[0].tolist())
        write(two, values[1].tolist())
        assert information.distance(one, two) == pytest.approx(model.distance(values[:1], values[1])[0])


def test_default_projection_is_the_feature(any_square):
    with make_problem(any_square, counter=Counter()) as problem:
        state = problem.space_information.allocState()
        values = np.random.default_rng(2).uniform(0, 5, len(any_square.state_low))
        value_writer(problem.setup.getStateSpace())(state, values.tolist())
        coordinates = np.zeros(2, dtype=np.int32)
        projection = problem.setup.getStateSpace().getDefaultProjection()
        assert projection.getCellSizes() == any_square.bin_size.tolist()
        projection.computeCoordinates(state, coordinates)
        expected = np.floor(any_square.feature(values[None])[0] / any_square.bin_size)
        assert coordinates.tolist() == expected.tolist()


def test_only_a_feature_beside_other_dimensions_needs_a_compound_space(square):
    assert isinstance(make_state_space(square()), ob.RealVectorStateSpace)
    assert isinstance(make_state_space(square(size=4, feature_dims=None)), ob.RealVectorStateSpace)
    assert make_state_space(square(size=5, feature_dims=(1, 2))).getSubspaceWeights() == [0.0, 1.0, 0.0]
