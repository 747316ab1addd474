"""Does Ex solve an OMPL problem that knows nothing of Gymnasium? A car in SE(2), controls of 1 to 10 steps.

    python examples/plain_ompl_car.py
"""

from math import cos, pi, sin, tan

from ompl import base as ob
from ompl import control as oc
from ompl import util as ou

from pbcs_ompl.planners import Ex

WALL_X, GAP_Y = 0.0, 0.5  # a wall at x = 0 that leaves a gap above y = 0.5


def propagate(state, control, duration, result):
    """Kinematic car: speed and steering angle are constant for `duration` seconds."""
    x, y, yaw = state.getX(), state.getY(), state.getYaw()
    speed, steering = control[0], control[1]
    result.setX(x + speed * duration * cos(yaw))
    result.setY(y + speed * duration * sin(yaw))
    yaw += speed * duration * tan(steering) / 0.2
    result.setYaw((yaw + pi) % (2 * pi) - pi)


def make_setup():
    """Return the problem: spaces, propagator, validity, start, goal."""
    space = ob.SE2StateSpace()
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(-1)
    bounds.setHigh(1)
    space.setBounds(bounds)
    controls = oc.RealVectorControlSpace(space, 2)
    limits = ob.RealVectorBounds(2)
    for index, limit in enumerate((0.5, 0.6)):  # m/s, rad
        limits.setLow(index, -limit)
        limits.setHigh(index, limit)
    controls.setBounds(limits)

    setup = oc.SimpleSetup(controls)
    si = setup.getSpaceInformation()
    si.setPropagationStepSize(0.1)
    si.setMinMaxControlDuration(1, 10)
    setup.setStatePropagator(propagate)

    def is_valid(state):
        inside = abs(state.getX()) <= 1 and abs(state.getY()) <= 1
        return inside and not (abs(state.getX() - WALL_X) < 0.05 and state.getY() < GAP_Y)

    setup.setStateValidityChecker(is_valid)
    start, goal = si.allocState(), si.allocState()
    for state, (x, y, yaw) in ((start, (-0.6, -0.6, 0.0)), (goal, (0.6, -0.6, 0.0))):
        state.setX(x)
        state.setY(y)
        state.setYaw(yaw)
    setup.setStartAndGoalStates(start, goal, 0.25)
    return setup


def main(seconds: float = 20.0) -> bool:
    ou.setLogLevel(ou.LOG_ERROR)
    setup = make_setup()
    setup.setPlanner(Ex.build(setup.getSpaceInformation(), seed=1))
    setup.solve(seconds)
    solved = setup.haveExactSolutionPath()
    if solved:
        path = setup.getSolutionPath()
        print(f"solved: {path.getControlCount()} controls, {path.length():.1f} s of driving, "
              f"OMPL's own check: {path.check()}")
    else:
        print("not solved")
    return solved


if __name__ == "__main__":
    main()
