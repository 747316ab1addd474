"""OMPL's KPIECE1, EST and RRT as compiled strategies: how they are held to OMPL's, see benchmarks/native_ompl."""

import numpy as np
import pytest

from pbcs_ompl.core.tree import Tree
from pbcs_ompl.planners import ESTCompiled, KPIECE1Compiled, PlanningContext, RRTCompiled
from pbcs_ompl.planners.kernels import est_loop
from pbcs_ompl.planners.kernels.grid import CELLS, NODES
from pbcs_ompl.planners.kernels.kpiece_loop import EXTERIOR, INTERIOR, ITERATION
from pbcs_ompl.planners.motions import ends_of, motions_of

KINDS = [KPIECE1Compiled, ESTCompiled, RRTCompiled]


def context(features=2):
    return PlanningContext(np.zeros(features), np.full(features, 4.0), np.full(features, 0.5), np.full(2, -0.1),
                           np.full(2, 0.1))


def tree_of(points):
    tree = Tree(points.shape[1], 2)
    tree.append(points, -1, 0.0, 0.0, False)
    return tree


@pytest.mark.parametrize("duration", [1, 4, [2, 5]])
@pytest.mark.parametrize("kind", KINDS)
def test_compiled_loops_make_the_tree_of_single_steps(solve, square, compiled_square, kind, duration):
    options = {"control_duration": duration}
    plain, compiled = (solve(lambda si, o=extra: kind.build(si, seed=3, **options, **o), model(goal=2.9, radius=0.1),
                             budget=2300)
                       for model, extra in ((square, {"batch": 1}), (compiled_square, {})))
    assert plain[0].error is compiled[0].error is None
    ours, theirs = plain[0].tree, compiled[0].tree
    assert len(theirs) > 200
    for name in ("parents", "states", "controls"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name))


@pytest.mark.parametrize("kind", KINDS)
def test_batches_grow_trees_too(solve, square, kind):
    planner, _, counter, _ = solve(lambda si: kind.build(si, batch=7, control_duration=3), square(goal=9.0), 999)
    assert planner.error is None
    assert counter.count == 999 == len(planner.tree) - 1


@pytest.mark.parametrize("kind", KINDS)
def test_only_ends_of_motions_are_expanded(solve, compiled_square, kind):
    tree = solve(lambda si: kind.build(si, control_duration=[3, 3]), compiled_square(goal=9.0), 3000)[0].tree
    depths = np.zeros(len(tree), int)
    for node, parent in enumerate(tree.parents.tolist()[1:], 1):
        depths[node] = depths[parent] + 1
    branching = np.flatnonzero(np.bincount(tree.parents[1:], minlength=len(tree)) > 1)
    assert len(branching)
    if kind is not KPIECE1Compiled:  # which cuts motions at the borders of cells
        assert (depths[branching] % 3 == 0).all()


def test_nodes_are_grouped_by_motions():
    tree = tree_of(np.zeros((1, 2)))
    for parent in (0, 0, 1, 2, 3):  # two motions: 1, 3, 5 and 2, 4
        tree.append(np.zeros((1, 2)), parent, 0.0, 0.0, False)
    assert motions_of(tree, 1, 6) == [[1, 3, 5], [2, 4]]
    assert ends_of(tree, 1, 6).tolist() == [4, 5]
    assert ends_of(tree, 0, 1).tolist() == [0]


@pytest.mark.parametrize("features", [1, 2, 4])
def test_est_draws_cells_by_the_inverse_of_their_nodes(features):
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 1.5, (60, features))
    strategy = ESTCompiled()
    strategy.start(context(features), rng)
    strategy.inserted(tree_of(points), 0, 60)
    _, cell, inside = np.unique(np.floor(points / 0.5), axis=0, return_inverse=True, return_counts=True)
    expected = 1 / inside[cell.ravel()] ** 2
    hits = np.bincount(strategy.select(tree_of(points), 100_000), minlength=60) / 100_000
    expected = expected / expected.sum()
    assert np.abs(hits - expected).max() < 5 * np.sqrt(expected.max() / 100_000)


def test_weights_of_a_sum_tree():
    rng, weights, plain = np.random.default_rng(1), np.zeros(32), np.zeros(16)
    for _ in range(200):
        number, weight = int(rng.integers(16)), float(rng.random())
        est_loop.weigh(weights, number, weight)
        plain[number] = weight
        assert weights[1] == pytest.approx(plain.sum())
        assert np.array_equal(weights[16:], plain)


@pytest.mark.parametrize("budget", [5, 200, 4000])
def test_heaps_and_importances_of_kpiece_by_brute_force(solve, compiled_square, budget):
    strategy = solve(lambda si: KPIECE1Compiled.build(si, bin_size=0.2, control_duration=4), compiled_square(goal=9.0),
                     budget)[0].strategy
    grid, judged = strategy._grid, strategy._judged
    count = int(grid.totals[CELLS])
    known, cells = judged.known[:count], {tuple(cell): n for n, cell in enumerate(grid.cells[:count].tolist())}
    assert grid.slices["length"][:count].sum() == grid.totals[NODES]
    assert judged.counts[ITERATION] > known["born"].max() - 1
    with np.errstate(divide="ignore"):
        expected = known["score"] / ((known["neighbours"] + 1) * known["coverage"] * known["selections"])
    assert np.array_equal(known["importance"], expected)
    for (x, y), number in cells.items():
        around = sum(cell in cells for cell in ((x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)))
        assert known["neighbours"][number] == around
        heap = INTERIOR if around == 4 else EXTERIOR
        place = known["place"][number]
        assert judged.heaps[heap, place] == number
        assert place < judged.counts[heap]
        if place:
            assert known["importance"][judged.heaps[heap, (place - 1) // 2]] >= known["importance"][number]
    assert judged.counts[INTERIOR] + judged.counts[EXTERIOR] == count
