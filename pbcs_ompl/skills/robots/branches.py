"""Random lines for robots whose heading counts: branches of a planner's tree, since they can drive along these."""

import numpy as np

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.robot import Robot
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array
from pbcs_ompl.skills.path_following.line import Line
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
    places, lines = places_of(robot, model.observe(tree.states)), list[Line]()
    for node in rng.integers(0, len(tree), 20 * count).tolist():
        line = line_through(robot, _branch(tree, places, node), spacing)
        if line.length > 0.2 * longest:
            kept = int(longest / line.spacing) + 1
            lines.append(Line(line.points[:kept], line.spacing, periods=line.periods))
        if len(lines) == count:
            return lines
    raise InvalidState(f"only {len(lines)} of {count} random branches are at least {0.2 * longest:g} long; choose "
                       "shorter ones, or worlds whose goals are farther away")


def _branch(tree: Tree, places: Array, node: int) -> Array:
    """Return the places [N, F] of the nodes from the root to one of them."""
    nodes = [node]
    while tree.parents[nodes[-1]] >= 0:
        nodes.append(int(tree.parents[nodes[-1]]))
    return places[nodes[::-1]]
