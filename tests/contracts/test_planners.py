"""What every registered planner promises, ours and OMPL's, on the thesis's 2x2 maze."""

import numpy as np
import pytest
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.trajectory import to_trajectory
from pbcs_ompl.core import registry
from pbcs_ompl.core.errors import InvalidOption, PlannerUnavailable
from pbcs_ompl.core.interfaces import BatchPlanner, PlannerFactory
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make

BUDGET = 60_000


def buildable():
    """Return the names of the planners that the installed OMPL can build, by trying on an empty problem."""
    space = ob.RealVectorStateSpace(2)
    box = ob.RealVectorBounds(2)
    box.setLow(0.0)
    box.setHigh(1.0)
    space.setBounds(box)
    controls = oc.RealVectorControlSpace(space, 2)
    controls.setBounds(box)
    names = []
    for name in registry.names("planner"):
        try:
            registry.load("planner", name).build(oc.SpaceInformation(space, controls), seed=1)
        except PlannerUnavailable:
            continue
        names.append(name)
    return names


@pytest.fixture(scope="module", params=buildable())
def entry(request):
    """A registered planner that the installed OMPL can build."""
    return registry.load("planner", request.param)


def search(entry, seed, budget, **options):
    """Return the outcome of one search as plain values, and what was found wrong with the path."""
    model, counter = make("pbcs/Maze-v0", {"size": 2}), Counter(budget)
    with make_problem(model, seed=seed, counter=counter) as problem:
        setup = problem.setup
        planner = entry.build(problem.space_information, seed=seed, **options)
        if isinstance(planner, BatchPlanner):
            planner.use_model(model, counter)
        setup.setPlanner(planner)
        setup.setup()
        callbacks = problem.callbacks
        status = planner.solve(ob.PlannerTerminationCondition(lambda: callbacks.stopped))
        callbacks.raise_error()
        count, states, controls, checked = counter.count, np.empty((0, 2)), np.empty((0, 2)), True
        if setup.haveExactSolutionPath():
            path = setup.getSolutionPath()
            trajectory = to_trajectory(path, problem.space_information, model)
            states, controls = trajectory.states, trajectory.controls
            counter.count = 0  # as the check makes all steps again
            checked = path.check()
        return status.getStatus(), count, states, controls, checked


def test_it_is_a_factory(entry):
    assert isinstance(entry, PlannerFactory)


def test_it_solves_the_2x2_maze_and_its_path_replays(entry):
    walks = getattr(entry, "__name__", "") == "RandomWalk"  # which rarely gets there
    budget, solved = 10_000 if walks else BUDGET, 0
    for seed in range(1, 4):
        status, count, states, controls, checked = search(entry, seed, budget)
        assert count <= budget
        if status != ob.PlannerStatus.EXACT_SOLUTION:
            continue
        solved += 1
        model = make("pbcs/Maze-v0", {"size": 2})
        assert np.array_equal(states[0], model.initial_state())
        assert np.array_equal(model.transition(states[:-1], controls).states, states[1:])
        assert model.transition(states[-2:-1], controls[-1:]).success[0]
        assert checked
    assert solved >= (0 if walks else 3)


def test_the_budget_is_kept(entry):
    for budget in (1, 50):
        _, count, _, _, _ = search(entry, 1, budget)
        assert count <= budget


def test_equal_seeds_give_equal_results(entry):
    first, again = (search(entry, 2, 5000) for _ in range(2))
    assert first[:2] == again[:2]
    assert np.array_equal(first[2], again[2])
    assert np.array_equal(first[3], again[3])


def test_misspelt_options_are_refused(entry):
    with pytest.raises(InvalidOption):
        search(entry, 1, 10, no_such_option=1)
