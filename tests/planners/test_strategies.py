"""What each strategy promises about the nodes it selects."""

import numpy as np
import pytest

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.planners import RRTNH, ESTAdapted, PlanningContext, RandomWalk, RRTSteered, Tree


def context(features=2, **others):
    return PlanningContext(np.zeros(features), np.full(features, 4.0), np.full(features, 0.5), np.full(2, -0.1),
                 np.full(2, 0.1), **others)


def tree_of(points, terminal=False):
    tree = Tree(points.shape[1], 2)
    tree.append(points, -1, 0.0, 0.0, terminal)
    return tree


@pytest.mark.parametrize("rule", ["draw", "least"])
@pytest.mark.parametrize("features", [1, 2, 3, 5])
def test_est_draws_nodes_by_omega(features, rule):
    """omega: the nodes in the 3^F cells around; beyond 4 features, in its cell."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(2.0, 0.2, (40, features)), rng.uniform(0, 4, (20, features))])
    strategy = ESTAdapted(rule=rule)
    strategy.start(context(features), rng)
    strategy.inserted(tree_of(points), 0, 60)
    reach = 1 if features <= 4 else 0
    cells = np.floor(points / (1.0 / (2 * reach + 1)))
    omega = (np.abs(cells[:, None] - cells[None]).max(axis=2) <= reach).sum(axis=1)
    weights = 1.0 / omega if rule == "draw" else omega == omega.min()
    expected = weights / weights.sum()
    hits = np.bincount(strategy.select(tree_of(points), 200_000), minlength=60) / 200_000
    assert np.abs(hits - expected).max() < 5 * np.sqrt(expected.max() / 200_000)


def test_rrt_selects_the_nearest_that_is_not_terminal():
    rng = np.random.default_rng(1)
    points, terminal = rng.uniform(0, 4, (300, 2)), rng.random(300) < 0.5
    strategy, tree = RRTNH(), tree_of(points, terminal)
    strategy.start(context(), rng)
    for first in range(0, 300, 50):
        strategy.inserted(tree, first, first + 50)
    targets = strategy.draw_targets(500)
    assert (targets >= 0).all()
    assert (targets <= 4).all()
    alive = np.flatnonzero(~terminal)
    expected = alive[((points[alive][None] - targets[:, None]) ** 2).sum(axis=2).argmin(axis=1)]
    assert np.array_equal(strategy.nearest_to(tree, targets), expected)


def test_rrt_needs_a_box():
    boundless = PlanningContext(np.zeros(2), np.full(2, np.inf), np.ones(2), np.zeros(2), np.ones(2))
    with pytest.raises(InvalidOption, match="bounded by"):
        RRTNH().start(boundless, np.random.default_rng(0))


def test_steering_reaches_the_goal_in_fewer_transitions(solve, square):
    steered, random = (np.median([solve(lambda si, s=seed, k=kind: k.build(si, seed=s), square(), 50_000)[2].count
                                  for seed in range(5)]) for kind in (RRTSteered, RRTNH))
    assert steered < 0.5 * random


def test_no_steering_is_named(solve, square):
    planner, _, _, _ = solve(lambda si: RRTSteered.build(si), square(steering=False))
    assert isinstance(planner.error, InvalidOption)


@pytest.mark.parametrize("walkers", [1, 5])
def test_random_walks_are_chains_from_the_root(solve, square, walkers):
    """Each walk begins at the root, ends after max_steps or at a terminal node, and never branches."""
    class Deadly(square):
        def transition(self, states, controls):
            result = super().transition(states, controls)
            return result._replace(terminated=result.states[:, 0] < 0.3)

    planner, _, _, _ = solve(lambda si: RandomWalk.build(si, max_steps=20, walkers=walkers), Deadly(goal=9.0), 1000)
    tree = planner.tree
    children = np.bincount(tree.parents[1:], minlength=len(tree))
    assert (children[1:] <= 1).all()
    lengths = np.array([len(tree.path_to(node)) - 1 for node in np.flatnonzero(children == 0)])
    ended = tree.terminal[children == 0]
    assert ended.any()
    assert (lengths <= 20).all()
    assert ((lengths == 20) | ended).sum() >= len(lengths) - walkers


@pytest.mark.parametrize(("kind", "options"), [
    (ESTAdapted, {"distance": 0.0}), (ESTAdapted, {"rule": "most"}), (ESTAdapted, {"distance": "far"}),
    (RandomWalk, {"max_steps": 0}), (RandomWalk, {"walkers": 1.5}),
])
def test_bad_values_are_refused(make_setup, square, kind, options):
    with pytest.raises(InvalidOption, match=next(iter(options))):
        kind.build(make_setup(square()).getSpaceInformation(), **options)
