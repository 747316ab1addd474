"""Random lines for robots whose heading counts: branches of a planner's tree, since they can drive along these."""

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.robot import Robot
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.lines import SHORTEST, long_lines
from pbcs_ompl.skills.robots.places import line_through, places_of

TRANSITIONS = 20_000
"""Budget of the search; it ends in the goal, if it comes there before (ours)."""


def random_branches(model: ResettableModel, robot: Robot, count: int, rng: np.random.Generator, *, longest: float,
                    spacing: float) -> list[Line]:
    """Return lines from the start to random nodes of a tree of Rides.

    Args:
        model: With the robot.
        robot: What the environment declares of it.
        count: How many.
        rng: The random numbers.
        longest: Where a line ends at the latest, a length.
        spacing: Of the points of a line.

    Raises:
        InvalidState: hardly any branch is long enough.
    """
    tree = plan(model, "Rides", seed=int(rng.integers(2**31)), max_transitions=TRANSITIONS).tree
    places = places_of(robot, model.observe(tree.states))
    branches = (tree.path_to(node) for node in rng.integers(0, len(tree), 20 * count))
    lines = long_lines((line_through(robot, places[nodes], spacing) for nodes in branches), count, longest)
    if len(lines) < count:
        raise InvalidState(f"only {len(lines)} of {count} random branches are at least {SHORTEST * longest:g} long; "
                           "choose shorter ones, or worlds whose goals are farther away")
    return lines
