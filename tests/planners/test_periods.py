"""Features with a period: bins, regions and neighbours go on at the other end."""

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.planners import ESTCompiled, Ex, KPIECE1Compiled, PlanningContext, Rides
from pbcs_ompl.planners.kernels.bin_queue import empty_queue, insert
from pbcs_ompl.planners.kernels.ranking import REGIONS
from pbcs_ompl.planners.kernels.regions import no_regions, open_bin, reserve

TURN = 2 * np.pi


def context(periods, edge=1.0):
    return PlanningContext(np.full(2, -10.0), np.full(2, 10.0), np.full(2, edge), np.full(2, -1.0), np.full(2, 1.0),
                           periods=np.array(periods))


def test_edges_divide_periods():
    edges, turns = context([TURN, 0.0]).bins("bin_size", None)
    assert turns.tolist() == [6, 0]
    assert edges == pytest.approx([TURN / 6, 1.0])
    assert context([TURN, 0.0], edge=100.0).bins("bin_size", None)[1].tolist() == [1, 0]


def test_states_that_differ_by_whole_periods_share_a_bin():
    rng = np.random.default_rng(0)
    points = rng.uniform(-2, 2, (200, 2))
    shifted = points + TURN * rng.integers(-3, 4, (200, 1)) * [1.0, 0.0]
    edges, turns = context([TURN, 0.0]).bins("bin_size", None)
    one, other = (insert(empty_queue(2, turns), np.array(given), np.zeros(200, bool), edges, 0)
                  for given in (points, shifted))
    assert one.num_bins == other.num_bins
    assert np.array_equal(one.cells[:one.num_bins], other.cells[:other.num_bins])


@pytest.mark.parametrize("turns", [1, 2, 3, 5, 8])
def test_regions_that_go_round_have_all_their_neighbours(turns):
    """Rows of bins that are closed in one feature: only the ends along the other have neighbours that are missing."""
    cells, length = [(i, j) for j in range(8) for i in range(turns)], 8
    regions = reserve(no_regions(2, 3, np.array([turns, 0])), len(cells), len(cells))
    for i, j in np.random.default_rng(turns).permutation(cells).tolist():
        open_bin(regions, np.array([i, j, 0]))
    known = int(regions.totals[REGIONS])
    for (_, j, scale), row in zip(regions.cells[:known].tolist(), regions.rows[:known], strict=True):
        ends = (j == 0) + (j == (length - 1) >> scale)
        assert row["missing"] == ends


@pytest.mark.parametrize("kind", [Ex, Rides, ESTCompiled, KPIECE1Compiled])
def test_an_angle_that_turns_is_not_new_for_ever(kind):
    strategy, tree = kind(), Tree(2, 2)
    strategy.start(context([TURN, 0.0]), np.random.default_rng(0))
    angles = np.linspace(0.0, 50 * TURN, 500)
    tree.append(np.column_stack([angles, np.zeros(500)]), -1, 0.0, 0.0, False)
    strategy.inserted(tree, 0, 500)
    strategy.select(tree, 1)
    bins = {Ex: lambda: strategy.queue.num_bins,
            Rides: lambda: int((strategy.regions.cells[:strategy.regions.totals[REGIONS], 2] == 0).sum())}
    assert bins.get(kind, lambda: int(strategy._grid.totals[0]))() == 6


def test_pendulums_declare_their_angles():
    assert pbcs_ompl.make("Pendulum-v1").feature_periods == pytest.approx([TURN, 0.0])
    assert pbcs_ompl.make("MountainCarContinuous-v0").feature_periods.tolist() == [0.0, 0.0]
    picked = pbcs_ompl.make("Pendulum-v1", goal="reward>-0.01", feature="state[1],state[0]")
    assert picked.feature_periods == pytest.approx([0.0, TURN])


def test_hinges_without_limits_turn_freely():
    pytest.importorskip("mujoco")
    assert pbcs_ompl.make("Reacher-v5").feature_periods == pytest.approx([TURN, 0.0])  # the elbow has limits
    assert pbcs_ompl.make("InvertedPendulum-v5", feature="qpos[1]").feature_periods == pytest.approx([0.0])


@pytest.mark.parametrize("periods", [[1.0], [-1.0, 0.0], [np.inf, 0.0]])
def test_bad_periods_are_refused(periods):
    from pbcs_ompl.resettable.model import _periods

    with pytest.raises(InvalidOption, match="feature_periods"):
        _periods(periods, [0, 1])
