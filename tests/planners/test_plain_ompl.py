"""OMPL problems that know nothing of environments."""

import math

import numpy as np
import pytest
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.core.errors import CallbackFailed, InvalidOption, UnsupportedSpace
from pbcs_ompl.planners import RRTNH, ESTAdapted, Ex, RandomWalk, RRTSteered


def bounds(low, high, size=2):
    box = ob.RealVectorBounds(size)
    box.setLow(float(low))
    box.setHigh(float(high))
    return box


def car(propagate=None, valid=None):
    """A car in SE(2) around a wall, controls (speed, turn rate) of 1 to 10 steps."""
    space = ob.SE2StateSpace()
    space.setBounds(bounds(0, 5))
    controls = oc.RealVectorControlSpace(space, 2)
    controls.setBounds(bounds(-1, 1))
    setup = oc.SimpleSetup(controls)

    def drive(state, control, duration, result):
        x, y, yaw = state.getX(), state.getY(), state.getYaw()
        speed, turn = control[0], control[1]
        result.setX(x + speed * math.cos(yaw) * duration)
        result.setY(y + speed * math.sin(yaw) * duration)
        result.setYaw((yaw + turn * duration + math.pi) % (2 * math.pi) - math.pi)

    def free(state):
        x, y = state.getX(), state.getY()
        return 0 <= x <= 5 and 0 <= y <= 5 and not (2 < x < 2.3 and y < 4)

    setup.setStatePropagator(propagate or drive)
    setup.setStateValidityChecker(valid or free)
    information = setup.getSpaceInformation()
    information.setMinMaxControlDuration(1, 10)
    information.setPropagationStepSize(0.1)
    start, goal = information.allocState(), information.allocState()
    for state, x in ((start, 1.0), (goal, 4.0)):
        state.setX(x)
        state.setY(1.0)
        state.setYaw(0.0)
    setup.setStartAndGoalStates(start, goal, 0.6)
    return setup


@pytest.mark.parametrize("kind", [Ex, RRTNH, ESTAdapted], ids=lambda kind: kind.__name__)
def test_a_car_is_solved_and_ompl_checks_its_path(kind):
    setup = car()
    planner = kind.build(setup.getSpaceInformation(), seed=1)
    setup.setPlanner(planner)
    status = setup.solve(20.0)
    assert planner.error is None
    assert status.getStatus() == ob.PlannerStatus.EXACT_SOLUTION
    path = setup.getSolutionPath()
    assert setup.haveExactSolutionPath()
    assert path.check()
    steps = np.array(path.getControlDurations()) / 0.1
    assert np.allclose(steps, steps.round())
    assert steps.max() > 1
    assert steps.min() >= 1
    assert len(planner.tree) - 1 <= planner.transitions


def test_equal_seeds_give_equal_trees_and_clear_continues_the_stream():
    trees = []
    for seed in (1, 1, 2):
        setup = car()
        planner = Ex.build(setup.getSpaceInformation(), seed=seed)
        setup.setPlanner(planner)
        setup.solve(20.0)
        trees.append(planner.tree.states.copy())
    assert np.array_equal(trees[0], trees[1])
    assert trees[0].shape != trees[2].shape
    setup.clear()
    assert planner.tree is None
    setup.solve(20.0)
    assert setup.haveExactSolutionPath()


def test_starts_that_are_added_are_used_and_another_problem_begins_at_its_own():
    setup = car(valid=lambda state: 0 <= state.getX() <= 5 and 0 <= state.getY() <= 5 and not 2 < state.getX() < 3)
    information = setup.getSpaceInformation()
    planner = Ex.build(information, seed=1)
    setup.setPlanner(planner)
    setup.solve(0.3)
    assert not setup.haveExactSolutionPath()
    nodes = len(planner.tree)
    second = information.allocState()
    second.setX(3.5)
    second.setY(1.0)
    second.setYaw(0.0)
    setup.addStartState(second)
    planner.solve(20.0)
    assert setup.haveExactSolutionPath()
    assert len(planner.tree) > nodes
    other = ob.ProblemDefinition(information)
    other.addStartState(second)
    other.setGoal(setup.getGoal())
    planner.setProblemDefinition(other)
    planner.solve(20.0)
    assert other.hasExactSolution()
    assert other.getSolutionPath().getState(0).getX() == 3.5
    assert (planner.tree.parents < 0).sum() == 1


def test_the_tree_is_that_of_the_projections():
    setup = car(valid=lambda state: state.getX() < 1.5)
    planner = Ex.build(setup.getSpaceInformation())
    planner.setProblemDefinition(setup.getProblemDefinition())
    setup.setup()
    calls = iter(range(400))
    assert planner.solve(lambda: next(calls) > 300).getStatus() == ob.PlannerStatus.TIMEOUT
    assert (planner.tree.states[:, 0] < 1.5).all()
    assert np.array_equal(planner.tree.states[0], [1.0, 1.0])
    data = planner.planner_data()
    assert data.numVertices() == len(planner.tree)
    assert data.numEdges() == len(planner.tree) - 1


def test_seconds_are_a_termination_condition_too():
    setup = car(valid=lambda state: state.getX() < 1.5)
    planner = RandomWalk.build(setup.getSpaceInformation())
    planner.setProblemDefinition(setup.getProblemDefinition())
    assert planner.solve(0.05).getStatus() == ob.PlannerStatus.TIMEOUT


def test_compound_controls_and_states():
    """Two carts on a line, as compounds of one-dimensional vectors."""
    space, box = ob.CompoundStateSpace(), bounds(0, 1, 1)
    for _ in range(2):
        line = ob.RealVectorStateSpace(1)
        line.setBounds(box)
        space.addSubspace(line, 1.0)
    space.lock()
    space.registerDefaultProjection(ob.SubspaceProjectionEvaluator(space, 0))
    controls = oc.CompoundControlSpace(space)
    for _ in range(2):
        part = oc.RealVectorControlSpace(space, 1)
        part.setBounds(bounds(-0.1, 0.1, 1))
        controls.addSubspace(part)
    setup = oc.SimpleSetup(controls)

    def move(state, control, duration, result):
        for cart in (0, 1):
            result[cart][0] = state[cart][0] + control[cart][0] * duration

    setup.setStatePropagator(move)
    setup.setStateValidityChecker(lambda state: all(0 <= state[cart][0] <= 1 for cart in (0, 1)))
    information = setup.getSpaceInformation()
    information.setPropagationStepSize(1.0)
    information.setMinMaxControlDuration(1, 2)
    start, goal = information.allocState(), information.allocState()
    for cart in (0, 1):
        start[cart][0], goal[cart][0] = 0.2, 0.8
    setup.setStartAndGoalStates(start, goal, 0.2)
    planner = Ex.build(information)
    setup.setPlanner(planner)
    setup.solve(20.0)
    assert planner.error is None
    assert setup.haveExactSolutionPath()
    assert setup.getSolutionPath().check()


def test_nan_from_the_propagator_names_the_transition():
    def propagate(state, control, duration, result):
        result.setX(state.getX())
        result.setY(state.getY())
        result.setYaw(float("nan"))

    setup = car(propagate=propagate)
    planner = Ex.build(setup.getSpaceInformation())
    setup.setPlanner(planner)
    status = setup.solve(5.0)
    assert status.getStatus() == ob.PlannerStatus.ABORT
    assert not status
    assert isinstance(planner.error, CallbackFailed)
    assert "not finite" in str(planner.error)
    assert "[1.0, 1.0]" in str(planner.error)


@pytest.mark.parametrize("where", ["propagator", "validity"])
def test_exceptions_of_callbacks_stay_in_python(where):
    def fail(*_):
        raise ZeroDivisionError("my own mistake")

    setup = car(propagate=fail) if where == "propagator" else car(valid=lambda s: s.getX() == 1.0 or fail())
    planner = Ex.build(setup.getSpaceInformation())
    setup.setPlanner(planner)
    assert setup.solve(5.0).getStatus() == ob.PlannerStatus.ABORT
    assert isinstance(planner.error, CallbackFailed)
    assert "my own mistake" in str(planner.error)
    assert isinstance(planner.error.__cause__, ZeroDivisionError)


def test_a_start_inside_the_goal_is_a_path_of_one_state():
    setup = car()
    information = setup.getSpaceInformation()
    start = information.allocState()
    start.setX(1.0)
    start.setY(1.0)
    start.setYaw(0.0)
    setup.setStartAndGoalStates(start, start, 0.6)
    setup.setPlanner(Ex.build(information))
    setup.solve(1.0)
    assert setup.haveExactSolutionPath()
    assert setup.getSolutionPath().getStateCount() == 1


def test_an_invalid_start_is_a_status():
    setup = car(valid=lambda state: False)
    planner = Ex.build(setup.getSpaceInformation())
    setup.setPlanner(planner)
    assert setup.solve(1.0).getStatus() == ob.PlannerStatus.INVALID_START


def test_steering_needs_an_environment():
    setup = car()
    planner = RRTSteered.build(setup.getSpaceInformation())
    setup.setPlanner(planner)
    setup.solve(1.0)
    assert isinstance(planner.error, InvalidOption)
    assert "RRTNH" in str(planner.error)


def test_a_space_without_projection_is_refused():
    space = ob.SO3StateSpace()
    plane = ob.CompoundStateSpace()
    plane.addSubspace(space, 1.0)
    plane.lock()
    controls = oc.RealVectorControlSpace(plane, 1)
    controls.setBounds(bounds(-1, 1, 1))
    setup = oc.SimpleSetup(controls)
    setup.setStatePropagator(lambda *_: None)
    setup.setStateValidityChecker(lambda state: True)
    planner = Ex.build(setup.getSpaceInformation())
    planner.setProblemDefinition(setup.getProblemDefinition())
    planner.solve(1.0)
    assert isinstance(planner.error, UnsupportedSpace)
