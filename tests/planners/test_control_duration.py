"""Controls that last several steps."""

import numpy as np
import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.planners import RRTNH, ESTAdapted, Ex, RandomWalk

MAZE = {"env_kwargs": {"size": 3}}


def runs_of(controls: np.ndarray) -> list[int]:
    """Return the lengths of the runs of equal rows."""
    changes = np.flatnonzero((controls[1:] != controls[:-1]).any(axis=1)) + 1
    return np.diff([0, *changes, len(controls)]).tolist()


@pytest.mark.parametrize("planner", ["Ex", "RRTNH", "ESTAdapted", "RRT", "KPIECE1"])
def test_controls_of_the_path_last_and_replay(planner: str) -> None:
    result = plan("pbcs/Maze-v0", planner, seed=1, max_transitions=300_000, planner_kwargs={"control_duration": 4},
                  **MAZE)
    assert result.solved
    assert result.replay_ok
    assert result.trajectory is not None
    lengths = runs_of(result.trajectory.actions)
    assert max(lengths) <= 4
    assert max(lengths) > 1


@pytest.mark.parametrize("kind", [Ex, RRTNH, ESTAdapted, RandomWalk])
@pytest.mark.parametrize("budget", [1, 7, 500])
def test_every_step_is_a_node_and_costs_one_transition(kind, budget: int) -> None:
    result, again = (plan("pbcs/Maze-v0", kind, max_transitions=budget, planner_kwargs={"control_duration": 5},
                          env_kwargs={"size": 9}) for _ in range(2))
    assert result.transitions == budget
    assert result.nodes == budget + 1
    np.testing.assert_array_equal(result.tree.states, again.tree.states)


def test_lengths_are_equally_likely() -> None:
    tree = plan("pbcs/Maze-v0", "RandomWalk", max_transitions=6000, planner_kwargs={"control_duration": 3},
                env_kwargs={"size": 9}).tree
    continued = np.array([(tree.controls[node] == tree.controls[parent]).all()
                          for node, parent in enumerate(tree.parents) if parent >= 0])
    assert continued.mean() == pytest.approx(0.5, abs=0.05)  # the mean length is 2


@pytest.mark.parametrize("planner", ["Ex", "RRT"])
@pytest.mark.parametrize("duration", [0, -1, 1.5, "many", True])
def test_bad_lengths_are_refused(planner: str, duration: object) -> None:
    with pytest.raises(InvalidOption, match="control_duration"):
        plan("pbcs/Maze-v0", planner, planner_kwargs={"control_duration": duration})
