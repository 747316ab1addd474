"""Rides: the compiled loop and single steps are the plain rule to the last bit, and what the rule promises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ompl import base as ob
from plain_rides import PlainRides

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.planners import Rides
from pbcs_ompl.planners.kernels import rides_loop
from pbcs_ompl.planners.kernels.ranking import REGIONS
from pbcs_ompl.planners.kernels.regions import no_regions, open_bin, reserve
from pbcs_ompl.planners.rides_without import PARTS, RidesWithout

EXACT, TIMEOUT = ob.PlannerStatus.EXACT_SOLUTION, ob.PlannerStatus.TIMEOUT


def plain(model, seed, budget, **options):
    """Return states, parents and controls of the plain rule, from the same random numbers."""
    rule = PlainRides(len(model.bin_size), model.bin_size, model.action_low, model.action_high,
                      SeedTree(seed).child("strategy").generator(), **{"longest": model.max_episode_steps} | options)
    states, parents, controls = [model.initial_state()], [-1], [np.zeros(len(model.action_low))]
    rule.root(0, states[0])
    for new in range(1, budget + 1):
        node, control = rule.next_step()
        result = model.transition(states[node][None], control[None])
        states.append(result.states[0])
        parents.append(node)
        controls.append(control)
        rule.take_step(new, states[new], (states[new] != states[node]).any(), result.terminated[0])
        if result.success[0]:
            break
    return np.array(states), np.array(parents), np.array(controls)


@pytest.mark.parametrize(("seed", "scales", "world"), [
    (0, 5, {}), (1, 5, {"goal": 9.0}), (2, 5, {"extent": 40.0, "goal": 39.9, "radius": 0.05}), (3, 1, {}),
    (4, 3, {"extent": 12.0, "goal": 99.0}), (5, 5, {"terminal": False, "radius": 0.02}),
])
def test_batch_1_and_compiled_are_the_plain_rule_to_the_last_bit(solve, square, compiled_square, seed, scales, world):
    states, parents, controls = plain(square(**world), seed, 6000, scales=scales)
    gears = ((square, {"batch": 1}), (compiled_square, {}), (compiled_square, {"batch": 1}))
    for kind, options in gears:
        planner, _, counter, _ = solve(lambda si, o=options: Rides.build(si, seed=seed, scales=scales, **o),
                                       kind(**world), 6000)
        assert planner.error is None
        assert counter.count == len(parents) - 1
        assert np.array_equal(planner.tree.states, states)
        assert np.array_equal(planner.tree.parents, parents)
        assert np.array_equal(planner.tree.controls, controls)


CHANGES = {
    "rides": {"longest": 1}, "scales": {"scales": 1}, "surface-controls": {"kinds": (0,)},
    "uniform-controls": {"kinds": (1,)}, "stop-when-still": {"still": False}, "stop-in-known-bins": {"known": 50},
    "learnt-scales": {"learns": ("kind", "patience")}}


@pytest.mark.parametrize("part", PARTS)
def test_without_a_part_it_is_the_plain_rule_without_it(solve, compiled_square, part):
    whole, _, _ = plain(compiled_square(goal=9.0), 0, 1500)
    states, parents, controls = plain(compiled_square(goal=9.0), 0, 1500, **CHANGES[part])
    planner, _, _, _ = solve(lambda si: RidesWithout.build(si, seed=0, part=part), compiled_square(goal=9.0), 1500)
    assert not np.array_equal(whole[0], states)
    assert np.array_equal(planner.tree.states, states)
    assert np.array_equal(planner.tree.parents, parents)
    assert np.array_equal(planner.tree.controls, controls)


def check_regions(regions, features):
    """Compare every stored number with one that is computed from the cells alone."""
    count = int(regions.totals[REGIONS])
    cells = {tuple(cell): number for number, cell in enumerate(regions.cells[:count].tolist())}
    assert len(cells) == count
    rows = regions.rows
    for cell, number in cells.items():
        around = [(*cell[:axis], cell[axis] + side, *cell[axis + 1:]) for axis in range(features)
                  for side in (-1, 1)]
        missing = sum(other not in cells for other in around)
        assert rows[number]["missing"] == missing
        key = rows[number]["count"] if missing else 4 * (rows[number]["count"] + 1)
        run = regions.runs[rows[number]["run"]]
        assert run["key"] == key
        assert run["first"] <= rows[number]["place"] < run["end"]
        assert regions.order[cell[-1], rows[number]["place"]] == number
    for scale in range(len(regions.order)):
        members = [number for cell, number in cells.items() if cell[-1] == scale]
        order = regions.order[scale, :len(members)].tolist()
        assert sorted(order) == sorted(members)
        keys = [regions.runs[rows[number]["run"]]["key"] for number in order]
        assert keys == sorted(keys, reverse=True)
        inner = sum(rows[number]["count"] for number in members)
        assert inner == sum(rows[number]["count"] for cell, number in cells.items() if cell[-1] == 0)
    return cells


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 8, 64]), st.sampled_from([1, 2, 3]))
def test_regions_by_brute_force(seed, width, features):
    """In a random walk of many rides, side by side too, all that is kept of the regions is true."""
    from pbcs_ompl.planners.context import PlanningContext

    rng = np.random.default_rng(seed)
    unit = np.ones(features)
    rides = Rides()
    rides.start(PlanningContext(-unit, unit, 0.5 * unit, -unit, unit), rng)
    from pbcs_ompl.core.tree import Tree

    tree = Tree(features, features)
    tree.append(np.zeros((1, features)), -1, 0.0, 0.0, False)
    rides.inserted(tree, 0, 1)
    for _ in range(200):
        nodes = rides.select(tree, width)
        controls = rides.controls(tree, nodes)
        assert not tree.terminal[nodes].any()
        states = np.clip(tree.states[nodes] + rng.choice([0.0, 0.3, 1.0]) * controls, -6.0, 6.0)
        first = len(tree)
        tree.append(states, nodes, controls, 0.0, rng.random(width) < 0.1)
        rides.inserted(tree, first, len(tree))
    regions = rides.regions
    cells = check_regions(regions, features)
    kept = {int(node) for cell, number in cells.items() if cell[-1] == 0
            for node in regions.pool[regions.rows[number]["start"]:][:regions.rows[number]["length"]]}
    assert kept == set(np.flatnonzero(~tree.terminal).tolist())


def test_opening_the_same_world_in_any_order_gives_the_same_regions():
    rng, points = np.random.default_rng(0), np.array([(x, y) for x in range(-9, 9) for y in range(-9, 9)])
    counts = set()
    for _ in range(3):
        regions = reserve(no_regions(2, 4), len(points), len(points))
        for point in rng.permutation(points):
            open_bin(regions, np.array([*point, 0]))
        check_regions(regions, 2)
        counts.add(int(regions.totals[REGIONS]))
    assert len(counts) == 1


def test_budget_and_second_solve_go_on_with_the_same_tree(solve, compiled_square):
    model = compiled_square(goal=99.0, extent=30.0)
    whole, status, counter, _ = solve(lambda si: Rides.build(si), model, 40_000)
    assert status == TIMEOUT
    assert counter.count == 40_000 == len(whole.tree) - 1
    parts, _, counter, _ = solve(lambda si: Rides.build(si), model, 2048)
    for budget in (4097, 20_000, 40_000):
        counter.budget = budget
        parts.solve(ob.PlannerTerminationCondition(lambda: False))
    assert np.array_equal(parts.tree.states, whole.tree.states)


def test_a_compiled_search_places_its_start_states_itself(solve, square, compiled_square, monkeypatch):
    """Also those that come between two solves; the kernels of the other way, which take long to compile, stay out."""
    trees = []
    for world in (square, compiled_square):
        planner, _, counter, setup = solve(lambda si: Rides.build(si, seed=4), world(goal=99.0, extent=30.0), 700)
        start = setup.getSpaceInformation().allocState()
        start[0], start[1] = 22.0, 19.0
        setup.getProblemDefinition().addStartState(start)
        counter.budget = 1500
        planner.solve(ob.PlannerTerminationCondition(lambda: False))
        assert planner.error is None
        trees.append(planner.tree)
        for name in ("begin", "note"):
            monkeypatch.setattr(rides_loop, name, None)
    by_hand, compiled = trees
    assert by_hand.parents.tolist().index(-1, 1) in by_hand.parents
    assert np.array_equal(compiled.parents, by_hand.parents)
    assert np.array_equal(compiled.states, by_hand.states)


def test_it_needs_fewer_transitions_than_ex():
    """On the thesis's mazes of size 7, in at least 9 of 10 seeds."""
    fewer = 0
    for seed in range(10):
        ex, rides = (plan("pbcs/Maze-v0", name, env_kwargs={"size": 7, "maze_seed": seed}, seed=seed)
                     for name in ("Ex", "Rides"))
        assert ex.solved
        assert rides.solved
        fewer += rides.transitions < ex.transitions
    assert fewer >= 9


def test_rides_go_on_side_by_side(solve, square):
    model, sizes = square(goal=9.0), []
    transition = model.transition

    def counted(states, controls):
        sizes.append(len(states))
        return transition(states, controls)

    model.parallel_batch, model.transition = 8, counted
    planner, _, counter, _ = solve(lambda si: Rides.build(si), model, 4001)
    assert planner.error is None
    assert counter.count == sum(sizes) == 4001
    assert set(sizes[:-1]) == {8}


def test_terminal_states_are_never_expanded_and_open_no_bins(solve, square):
    class Deadly(square):
        def transition(self, states, controls):
            result = super().transition(states, controls)
            dead = result.states[:, 0] > 1.0
            return result._replace(terminated=dead, success=np.zeros_like(dead))

    for batch in (1, 16):
        planner, status, _, _ = solve(lambda si, b=batch: Rides.build(si, batch=b), Deadly(), 4000)
        tree = planner.tree
        assert status == TIMEOUT
        assert tree.terminal.any()
        assert not tree.terminal[tree.parents[1:]].any()


def test_memory_is_of_the_order_of_the_nodes(solve, compiled_square):
    """However many rides begin in a small closed world: 60 bytes a node, tree and regions together."""
    for world in ({"extent": 1.0}, {"extent": 30.0}):
        planner, _, _, _ = solve(lambda si: Rides.build(si), compiled_square(goal=99.0, **world), 300_000)
        assert (planner.tree.nbytes + planner.strategy.nbytes) / len(planner.tree) < 60


def test_how_long_controls_last_is_no_option(make_setup, square):
    si = make_setup(square()).getSpaceInformation()
    with pytest.raises(InvalidOption, match=r"'control_duration'; choose from batch, bin_size, scales"):
        Rides.build(si, control_duration=3)
    for options in ({"scales": 0}, {"scales": 17}, {"bin_size": -1.0}):
        with pytest.raises(InvalidOption):
            Rides.build(si, **options)


def test_it_runs_on_a_plain_ompl_problem(make_setup, square):
    """There a step of a ride lasts the least duration of the problem, and motions that are not valid end rides."""
    setup = make_setup(square())
    setup.setStateValidityChecker(lambda state: not 1.0 < state[0] < 1.2 or state[1] > 2.0)
    planner = Rides.build(setup.getSpaceInformation(), seed=3, batch=4)
    setup.setPlanner(planner)
    setup.setup()
    status = planner.solve(ob.PlannerTerminationCondition(lambda: planner.transitions > 50_000))
    assert planner.error is None
    assert status.getStatus() == EXACT
    assert setup.getSolutionPath().check()
