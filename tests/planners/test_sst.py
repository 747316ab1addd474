"""SST, alone and behind Rides: the kernel is the plain rule, and a search that continues finds ever shorter paths."""

from itertools import pairwise

import numpy as np
import pytest
from ompl import base as ob
from plain_sst import PlainSST

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Counter
from pbcs_ompl.planners import Rides, RidesSST, SSTCompiled
from pbcs_ompl.planners.kernels.motion import to_surface
from pbcs_ompl.planners.kernels.witnesses import choose, no_witnesses, note, reserve

KINDS = [SSTCompiled, RidesSST]
ARRAYS = ("parents", "states", "controls", "rewards", "terminal")


class Focused(SSTCompiled):
    """With the targets and controls of RidesSST from the first step on."""

    _beside_path = _on_surface = 0.5


def depths_of(tree):
    depths = np.zeros(len(tree), int)
    for node, parent in enumerate(tree.parents.tolist()[1:], 1):
        depths[node] = depths[parent] + 1
    return depths


@pytest.mark.parametrize("duration", [4, [2, 5]])
@pytest.mark.parametrize(("kind", "share"), [(SSTCompiled, 0.0), (Focused, 0.5)])
def test_the_kernel_is_the_plain_rule(solve, square, compiled_square, kind, share, duration):
    options = {"beside_path": share, "on_surface": share}
    plain = solve(lambda si: PlainSST.build(si, seed=3, batch=1, control_duration=duration, **options),
                  square(goal=2.0), budget=2500)
    compiled = solve(lambda si: kind.build(si, seed=3, control_duration=duration), compiled_square(goal=2.0),
                     budget=2500)
    assert plain[0].error is compiled[0].error is None
    assert len(compiled[0].solutions) > 1
    for name in ARRAYS:
        assert np.array_equal(getattr(plain[0].tree, name), getattr(compiled[0].tree, name))
    assert np.array_equal(plain[0].solution, compiled[0].solution)


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("kind", KINDS)
def test_compiled_loops_make_the_tree_of_single_steps(solve, square, compiled_square, kind, terminal):
    plain, compiled = (solve(lambda si, o=extra: kind.build(si, seed=2, **o), model(terminal=terminal), budget=3000)
                       for model, extra in ((square, {"batch": 1}), (compiled_square, {})))
    assert plain[0].error is compiled[0].error is None
    for name in ARRAYS:
        assert np.array_equal(getattr(plain[0].tree, name), getattr(compiled[0].tree, name))
    assert [one[::2] for one in plain[0].solutions] == [one[::2] for one in compiled[0].solutions]


@pytest.mark.parametrize("options", [{}, {"batch": 7}])
@pytest.mark.parametrize("kind", KINDS)
def test_it_continues_to_the_end_of_the_budget_with_shorter_paths_only(solve, square, compiled_square, kind, options):
    for model in (square(), compiled_square()):
        planner, status, counter, setup = solve(lambda si: kind.build(si, **options), model, 3000)
        tree, found = planner.tree, planner.solutions
        assert status == ob.PlannerStatus.EXACT_SOLUTION
        assert counter.count == 3000 == len(tree) - 1
        assert len(found) > (kind is SSTCompiled)  # the first of Rides may be the best there is
        assert all(late.steps < early.steps for early, late in pairwise(found))
        assert all(late.transitions > early.transitions for early, late in pairwise(found))
        assert found[-1].steps == len(planner.solution) - 1 == round(setup.getSolutionPath().length())
        assert model.goal_distance(tree.states[planner.solution[-1:]])[0] < model.goal_threshold
        if not options:  # what can only be longer is not tried; side by side some are under way
            depths = depths_of(tree)
            for one in found:
                assert depths[one.transitions + 1:].max(initial=0) < one.steps


def test_a_second_solve_continues_with_the_tree_and_the_path(make_setup, compiled_square):
    setup, model = make_setup(compiled_square()), compiled_square()
    planner = SSTCompiled.build(setup.getSpaceInformation(), seed=1)
    counter = Counter(2000)
    planner.use_model(model, counter)
    setup.setPlanner(planner)
    setup.setup()
    assert planner.solve(lambda: False).getStatus() == ob.PlannerStatus.EXACT_SOLUTION
    first = planner.solutions
    counter.budget = 4000
    assert planner.solve(lambda: False).getStatus() == ob.PlannerStatus.EXACT_SOLUTION
    assert planner.solutions[:len(first)] == first
    assert len(planner.tree) == 4001
    planner.clear()
    assert planner.solution is None
    assert planner.solutions == []


def test_without_a_model_it_searches_any_problem_of_ompl(make_setup, square):
    setup = make_setup(square())
    planner = SSTCompiled.build(setup.getSpaceInformation(), seed=1)
    setup.setPlanner(planner)
    setup.setup()
    assert planner.solve(lambda: planner.transitions >= 1500).getStatus() == ob.PlannerStatus.EXACT_SOLUTION
    assert planner.transitions >= 1500
    assert setup.getSolutionPath().check()


def test_the_first_solution_is_that_of_rides(solve, compiled_square):
    rides, continues = (solve(lambda si, k=kind: k.build(si, seed=5), compiled_square(), 3000)[0]
                      for kind in (Rides, RidesSST))
    assert continues.solutions[0][::2] == rides.solutions[0][::2]
    for name in ARRAYS:
        assert np.array_equal(getattr(continues.tree, name)[:len(rides.tree)], getattr(rides.tree, name))


@pytest.mark.parametrize("features", [1, 2, 4])
def test_witnesses_by_brute_force(features):
    rng = np.random.default_rng(features)
    witnesses, points, standing = no_witnesses(features), [], []
    for node in range(600):
        point, cost = rng.uniform(0, 9, features), int(rng.integers(30))
        witnesses = reserve(witnesses, 1)
        away = [np.linalg.norm(point - other) for other in points]
        alone = not away or min(away) > 1.0
        kept = alone or cost < standing[int(np.argmin(away))][1]
        assert note(witnesses, point[None], np.empty(1, np.int64), node, cost, 1.0) == kept
        if alone:
            points.append(point)
            standing.append((node, cost))
        elif kept:
            standing[int(np.argmin(away))] = (node, cost)
    count = int(witnesses.totals[0])
    costs = np.array([cost for _, cost in standing])
    assert witnesses.nodes[:count].tolist() == [node for node, _ in standing]
    assert witnesses.costs[:count].tolist() == costs.tolist()
    for bound in (10**6, 15):
        for target in rng.uniform(-3, 12, (200, features)):
            away = np.linalg.norm(np.array(points) - target, axis=1)
            away[costs + 1 >= bound] = np.inf
            near = np.flatnonzero(away <= 2.0)
            expected = near[costs[near].argmin()] if len(near) else away.argmin()
            assert choose(witnesses, target[None], 2.0, bound) == expected


def test_controls_on_the_surface():
    bounds, rng = np.array([[-1.0, 0.0, 2.0], [1.0, 4.0, 2.0]]), np.random.default_rng(0)
    for control in rng.uniform(bounds[0], bounds[1], (100, 3)):
        scaled = control[None].copy()
        to_surface(bounds, scaled, 0)
        unit = (scaled[0, :2] - [0.0, 2.0]) / [1.0, 2.0]
        assert np.abs(unit).max() == pytest.approx(1.0)
        before = (control[:2] - [0.0, 2.0]) / [1.0, 2.0]
        np.testing.assert_allclose(unit, before / np.abs(before).max())
        assert scaled[0, 2] == 2.0
    middle = np.array([[0.0, 2.0, 2.0]])
    to_surface(bounds, middle, 0)
    assert middle.tolist() == [[0.0, 2.0, 2.0]]


@pytest.mark.parametrize(("env", "kwargs", "more", "share"), [
    ("pbcs/Maze-v0", {"size": 3}, 500, 2.0), ("MountainCarContinuous-v0", {}, 60, 0.2)])
def test_numbers_of_the_search_are_those_until_its_first_solution(env, kwargs, more, share):
    rides = plan(env, Rides, env_kwargs=kwargs, seed=1)
    for amount, made in (("0%", 0), (more, more), (f"{100 * share:g}%", int(share * rides.transitions))):
        found = plan(env, RidesSST, env_kwargs=kwargs, improve=amount, seed=1)
        assert found.solved
        assert found.replay_ok
        assert found.transitions == rides.transitions
        assert found.nodes == rides.nodes + made
        note = found.improvement
        assert (note is None) == (made == 0)
        if note is not None:
            assert (note.before, note.after, note.transitions) == (rides.path_length, found.path_length, made)
            assert note.progress["length"][-1] == note.after
            assert note.progress["transitions"][0] == 0


def test_all_of_the_budget_is_used_unless_a_user_says_less():
    whole = plan("pbcs/Maze-v0", SSTCompiled, env_kwargs={"size": 2}, max_transitions=20_000)
    assert whole.improvement is not None
    assert whole.transitions + whole.improvement.transitions == 20_000 == whole.nodes - 1
    short = plan("pbcs/Maze-v0", SSTCompiled, env_kwargs={"size": 2}, improve="0.05s")
    assert short.improvement is not None
    assert 0.04 < short.improvement.seconds < 1.0
    assert short.nodes < 1_000_000


@pytest.mark.parametrize("options", [{"selection_radius": 0}, {"pruning_radius": -1.0}, {"pruning_radius": [1, 2]}])
def test_bad_radii_are_refused(options):
    with pytest.raises(InvalidOption, match="radius"):
        plan("pbcs/Maze-v0", SSTCompiled, planner_kwargs=options)
