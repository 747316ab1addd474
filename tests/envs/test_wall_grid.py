"""The grid lists every wall that a step can touch."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.envs.maze import kernels
from pbcs_ompl.envs.wall_grid import CELLS_PER_UNIT, build_wall_grid

REACH = 0.1
on_cell_edges = st.integers(0, 3 * CELLS_PER_UNIT).map(lambda n: n / CELLS_PER_UNIT)
position = on_cell_edges | st.floats(0.0, 3.0)
step = st.sampled_from([-REACH, 0.0, REACH]) | st.floats(-REACH, REACH)


@given(x=position, y=position, a=step, b=step, seed=st.integers(0, 2**31))
@settings(max_examples=150, deadline=None)
def test_a_wall_that_is_touched_is_listed(x: float, y: float, a: float, b: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = np.array([x + a, y + b]) + rng.uniform(-0.01, 0.01, (20, 2)) * rng.integers(0, 2, (20, 1))
    walls = np.concatenate([corners, corners + rng.uniform(0.0, 0.3, (20, 2))], axis=1)
    grid = build_wall_grid(walls, 3.0, REACH)
    i, j = (min(int(v * CELLS_PER_UNIT), grid.cells - 1) for v in (x, y))
    cell = i * grid.cells + j
    listed = set(grid.lists[grid.lists[cell]:grid.lists[cell + 1]].tolist())
    touched = {k for k, wall in enumerate(walls) if kernels.hits_rectangle(x, y, x + a, y + b, *wall)}
    assert touched <= listed


@pytest.mark.parametrize("extent", [2.0, 50.0])
def test_far_walls_are_not_listed(extent: float) -> None:
    grid = build_wall_grid(np.array([[0.0, 0.0, 0.1, 0.1]]), extent, REACH)
    begins, listed = grid.lists[:grid.cells**2 + 1], grid.lists[grid.cells**2 + 1:]
    assert listed.tolist() == [0] * 4  # the wall and its reach meet 2 x 2 cells
    assert begins[-1] == len(grid.lists)
