"""A small world that knows nothing of `envs`: a point in a unit-step square, in pure NumPy."""

from typing import Any

import numpy as np
import pytest
from model_env import ModelEnv
from numba import njit
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.types import Counter, Transition


@njit("Tuple((f8, b1, b1))(f8[::1], f8[:, ::1], i8[::1], f8[:, ::1], i8, f8[:, ::1], i8)")
def _compiled(reals, table, integers, states, parent, controls, child):
    extent, goal, radius, terminal = reals
    inside = True
    for axis in range(2):
        moved = states[parent, axis] + controls[child, axis]
        inside = inside and 0.0 <= moved <= extent
    for axis in range(2):
        states[child, axis] = states[parent, axis] + (controls[child, axis] if inside else 0.0)
    success = max(abs(states[child, 0] - goal), abs(states[child, 1] - goal)) < radius
    return (1.0 if success else 0.0), success and terminal > 0.0, success


class Square:
    """s' = s + a within [0, extent]^2, else s' = s; success within `radius` of (goal, goal), maximum norm."""

    env, spec, capabilities = None, EnvSpec("tests/Square"), frozenset({"visited", "arbitrary", "exact"})
    observation_size, max_episode_steps, parallel_batch = 2, 50, 1
    episode_limit: int | None = None
    walls, goal_circle, feature_periods = np.empty((0, 4)), None, np.zeros(2)
    feature_dims: tuple[int, ...] | None = (0, 1)

    def __init__(self, extent: float = 3.0, goal: float = 2.7, radius: float = 0.3, terminal: bool = True,
                 steering: bool = True):
        self.extent, self.goal, self.goal_threshold, self.terminal = extent, goal, radius, terminal
        self.steering = steering
        self.state_low, self.state_high = np.zeros(2), np.full(2, extent)
        self.action_low, self.action_high = np.full(2, -0.1), np.full(2, 0.1)
        self.feature_low, self.feature_high = self.state_low, self.state_high
        self.bin_size = np.full(2, 0.25)

    def make_env(self) -> ModelEnv:
        return ModelEnv(self)

    def initial_state(self, seed: int | None = None):
        return np.full(2, 0.5)

    def transition(self, states, controls):
        moved = states + controls
        inside = ((moved >= 0.0) & (moved <= self.extent)).all(axis=1)
        after = np.where(inside[:, None], moved, states)
        success = self.goal_distance(after) < self.goal_threshold
        return Transition(after, success.astype(np.float64), success & self.terminal, success)

    def feature(self, states):
        return np.array(states)

    def goal_distance(self, states):
        return np.abs(states - self.goal).max(axis=1)

    def advance_towards(self, states, targets):
        from pbcs_ompl.core.errors import InvalidOption

        if not self.steering:
            raise InvalidOption("tests/Square offers no steering")
        return np.clip(targets - states, self.action_low, self.action_high)


class CompiledSquare(Square):
    """The same, compiled."""

    def compiled_step(self):
        reals = np.array([self.extent, self.goal, self.goal_threshold, float(self.terminal)])
        return _compiled, reals, np.zeros((1, 1)), np.zeros(1, np.int64)


def square_setup(model: Any) -> Any:
    """Return a SimpleSetup of the square, with the propagator through `transition`."""
    space = ob.RealVectorStateSpace(2)
    box = ob.RealVectorBounds(2)
    box.setLow(0.0)
    box.setHigh(float(model.extent))
    space.setBounds(box)
    space.registerDefaultProjection(ob.RealVectorOrthogonalProjectionEvaluator(space, [0.25, 0.25], [0, 1]))
    controls = oc.RealVectorControlSpace(space, 2)
    limits = ob.RealVectorBounds(2)
    limits.setLow(-0.1)
    limits.setHigh(0.1)
    controls.setBounds(limits)
    setup = oc.SimpleSetup(controls)
    transition = model.transition

    def propagate(state: Any, control: Any, duration: float, result: Any) -> None:
        after = transition(np.array([[state[0], state[1]]]), np.array([[control[0], control[1]]])).states[0]
        result[0], result[1] = float(after[0]), float(after[1])

    setup.setStatePropagator(propagate)
    setup.setStateValidityChecker(lambda state: True)
    information = setup.getSpaceInformation()
    information.setPropagationStepSize(1.0)
    information.setMinMaxControlDuration(1, 1)
    start, goal = information.allocState(), information.allocState()
    start[0] = start[1] = 0.5
    goal[0] = goal[1] = float(model.goal)
    setup.setStartAndGoalStates(start, goal, float(model.goal_threshold))
    return setup


def solve_square(make_planner: Any, model: Any, budget: int = 5000) -> tuple[Any, Any, Counter, Any]:
    """Return the planner after `solve`, its status, the counter and the setup."""
    setup, counter = square_setup(model), Counter(budget)
    planner = make_planner(setup.getSpaceInformation())
    planner.use_model(model, counter)
    setup.setPlanner(planner)
    setup.setup()
    status = planner.solve(ob.PlannerTerminationCondition(lambda: False)).getStatus()
    return planner, status, counter, setup


@pytest.fixture(scope="session")
def square():
    """The model class in NumPy."""
    return Square


@pytest.fixture(scope="session")
def compiled_square():
    """The model class with a compiled step."""
    return CompiledSquare


@pytest.fixture(scope="session")
def make_setup():
    """model -> SimpleSetup."""
    return square_setup


@pytest.fixture(scope="session")
def solve():
    """(make_planner, model, budget) -> planner, status, counter, setup."""
    return solve_square
