"""Laws of the callbacks: propagation is the environment's step, counted; nothing crosses OMPL's C++."""

import math
import subprocess
import sys

import numpy as np
import pytest
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.termination import make_stop
from pbcs_ompl.bridge.trajectory import to_trajectory
from pbcs_ompl.core.errors import CallbackFailed, InvalidState, UnsupportedSpace
from pbcs_ompl.core.ompl_access import quiet_ompl, value_reader, value_writer
from pbcs_ompl.core.types import Counter


def propagate(problem, state, control, steps=1, alias=False):
    """Return the state that OMPL's propagate leads to."""
    information = problem.space_information
    before, action = information.allocState(), information.allocControl()
    after = before if alias else information.allocState()
    value_writer(information.getStateSpace())(before, state)
    for dim, value in enumerate(control):
        action[dim] = value
    information.propagate(before, action, steps, after)
    return value_reader(information.getStateSpace())(after)


@pytest.mark.parametrize("alias", [False, True])
@pytest.mark.parametrize("steps", [1, 4])
def test_propagate_is_the_step_of_the_environment(any_square, steps, alias):
    rng = np.random.default_rng(0)
    counter = Counter()
    with make_problem(any_square, counter=counter) as problem:
        for _ in range(10):
            state = rng.uniform(0, 5, len(any_square.state_low)).tolist()
            control = rng.uniform(-0.3, 0.3, 2).tolist()
            expected = state
            for _ in range(steps):
                expected = any_square.step_one(expected, control)
            assert propagate(problem, state, control, steps, alias) == expected
    assert counter.count == 10 * steps


def test_budget_is_never_exceeded(square):
    counter = Counter(3)
    with make_problem(square(), counter=counter) as problem:
        ends = [propagate(problem, [1.0, 1.0], [0.1, 0.1])[0] for _ in range(5)]
        assert problem.callbacks.stopped
    assert counter.count == 3
    assert ends == [1.1, 1.1, 1.1, 1.0, 1.0]


def raising(*_):
    raise RuntimeError("broken world")


@pytest.mark.parametrize("planner", [oc.RRT, oc.EST, oc.KPIECE1])
@pytest.mark.parametrize(("method", "answer", "message"), [
    ("step_one", raising, "RuntimeError: broken world"),
    ("step_one", lambda *_: [math.nan, 1.0], "expected finite numbers"),
    ("step_one", lambda *_: [math.inf, 1.0], "expected finite numbers"),
    ("step_one", lambda *_: None, "TypeError"),
    ("goal_distance", raising, "RuntimeError: broken world"),
    ("goal_distance", lambda states: np.full(len(states), np.nan), "is NaN"),
])
def test_failing_callback_stops_the_planner_and_is_raised_again(square, planner, method, answer, message):
    model = square()
    healthy, calls = getattr(model, method), []

    def failing(*arguments):
        calls.append(1)
        return healthy(*arguments) if len(calls) < 30 else answer(*arguments)

    setattr(model, method, failing)
    with quiet_ompl(), make_problem(model, counter=Counter(10_000)) as problem:
        solve(problem, planner)
        assert not problem.setup.haveExactSolutionPath()
        with pytest.raises(CallbackFailed, match=message):
            problem.callbacks.raise_error()
    assert len(calls) <= 31


def solve(problem, planner):
    """Run one of OMPL's planners on a problem."""
    built = planner(problem.space_information)
    problem.setup.setPlanner(built)
    problem.setup.setup()
    built.solve(ob.PlannerTerminationCondition(make_stop(problem.callbacks, 10.0, None)))
    return built


def solve_square(model, planner, seed, budget=50_000):
    """Return the states of the path that a planner finds, and OMPL's own opinion of it."""
    with quiet_ompl(), make_problem(model, seed=seed, counter=Counter(budget)) as problem:
        solve(problem, planner)
        assert problem.setup.haveExactSolutionPath()
        path = problem.setup.getSolutionPath()
        return to_trajectory(path, problem.space_information, model), path.check()


@pytest.mark.parametrize("planner", [oc.RRT, oc.EST, oc.KPIECE1])
def test_stock_planners_solve_and_their_paths_are_true(any_square, planner):
    trajectory, accepted = solve_square(any_square, planner, seed=1)
    assert accepted
    assert trajectory.replays_exactly(any_square)
    assert any_square.goal_distance(trajectory.states[-1:])[0] < any_square.goal_threshold
    assert any_square.is_valid(trajectory.states).all()


def digest(planner, seed, model):
    states = solve_square(model, getattr(oc, planner), seed)[0].states
    return states.tobytes().hex()


@pytest.mark.parametrize("planner", ["RRT", "EST", "KPIECE1"])
def test_equal_seeds_give_equal_paths_here_and_in_a_fresh_process(square, planner, request):
    model = square()
    first = {seed: digest(planner, seed, model) for seed in (0, 1, 2)}
    assert len(set(first.values())) == 3
    assert {seed: digest(planner, seed, model) for seed in (2, 0, 1)} == first
    program = ("import sys; sys.path[:0] = [sys.argv[1], sys.argv[1] + '/..']; import conftest, test_problem; "
               "print(test_problem.digest(sys.argv[2], 2, conftest.Square()))")
    fresh = subprocess.run([sys.executable, "-c", program, str(request.path.parent), planner],
                           capture_output=True, text=True, check=True)
    assert fresh.stdout.strip() == first[2]


def test_states_of_the_environment_are_not_tested_again(square):
    model = square()
    asked = []
    model.is_valid = lambda states: asked.append(states) or np.full(len(states), True)
    with make_problem(model, counter=Counter()) as problem:
        information = problem.space_information
        before, after = information.allocState(), information.allocState()
        action = information.allocControl()
        before[0:2] = [1.0, 1.0]
        action[0], action[1] = 0.1, 0.0
        asked.clear()
        assert information.propagateWhileValid(before, action, 3, after) == 3
        assert not asked
        assert information.isValid(before)
        assert len(asked) == 1


def test_validity_is_bounds_and_walls(square):
    with make_problem(square(), counter=Counter()) as problem:
        state = problem.space_information.allocState()
        cases = {(1.0, 1.0): True, (2.1, 1.0): False, (5.1, 1.0): False, (2.1, 4.0): True}
        for values, valid in cases.items():
            state[0:2] = values
            assert problem.space_information.isValid(state) is valid


def test_goal_is_strict_and_gives_no_bias(square):
    with make_problem(square(radius=0.5, goal=4.0), counter=Counter()) as problem:
        goal, state = problem.setup.getGoal(), problem.space_information.allocState()
        state[0:2] = [4.0, 4.5]
        assert goal.distanceGoal(state) == 0.5
        assert not goal.isSatisfied(state)
        state[0:2] = [4.0, 4.4]
        assert goal.isSatisfied(state)
        assert not goal.hasType(ob.GoalType.GOAL_SAMPLEABLE_REGION)


@pytest.mark.parametrize(("start", "message"), [
    ([2.1, 1.0], "inside a wall"), ([6.0, 1.0], "dimension 0"), ([1.0, math.nan], "not finite"),
    ([1.0], "shape"),
])
def test_impossible_start_is_refused(square, start, message):
    with pytest.raises(InvalidState, match=message):
        make_problem(square(), start=np.array(start), counter=Counter())


def test_custom_start_is_where_the_tree_starts(square):
    with quiet_ompl(), make_problem(square(), start=np.array([3.0, 4.0]), counter=Counter(5_000)) as problem:
        solve(problem, oc.RRT)
        trajectory = to_trajectory(problem.setup.getSolutionPath(), problem.space_information, problem.model)
    assert trajectory.states[0].tolist() == [3.0, 4.0]


def test_unbounded_space_is_refused(square):
    model = square()
    model.state_high = np.array([5.0, np.inf])
    with pytest.raises(UnsupportedSpace, match="finite bounds"):
        make_problem(model, counter=Counter())


def test_duration_is_one_step(square):
    with make_problem(square(), counter=Counter()) as problem:
        information = problem.space_information
        assert (information.getMinControlDuration(), information.getMaxControlDuration()) == (1, 1)
        assert information.getPropagationStepSize() == 1.0
