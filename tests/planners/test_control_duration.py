"""Controls that last several steps."""

import numpy as np
import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption
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


@pytest.mark.parametrize("duration", [1, 4, [2, 5], [3, 3]])
@pytest.mark.parametrize("kind", [Ex, RRTNH, ESTAdapted, RandomWalk])
def test_compiled_loops_make_the_tree_of_transitions(solve, square, compiled_square, kind, duration) -> None:
    """Ex one control at a time in its own loop, the others in batches: the same bits as through `transition`."""
    batch = 1 if kind is Ex else "grow"
    for seed, budget in ((0, 3000), (1, 777)):
        plain, compiled = (solve(lambda si, s=seed, b=b: kind.build(si, seed=s, batch=b, control_duration=duration),
                                 model(goal=2.9, radius=0.1), budget)
                           for model, b in ((square, batch), (compiled_square, "grow")))
        assert plain[0].error is compiled[0].error is None
        assert plain[1] == compiled[1]
        ours, theirs = plain[0].tree, compiled[0].tree
        assert compiled[2].count == len(theirs) - 1
        for name in ("states", "controls", "parents", "rewards", "terminal"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


def test_least_and_most_are_kept(solve, compiled_square) -> None:
    """No control is cut short but those of the last batch, which the budget ends."""
    for kind in (Ex, RRTNH):
        tree = solve(lambda si, k=kind: k.build(si, control_duration=[2, 4]), compiled_square(goal=9.0), 4000)[0].tree
        lasts, begun = np.ones(len(tree), int), np.zeros(len(tree), bool)
        for node in range(1, len(tree)):
            parent = tree.parents[node]
            begun[node] = (tree.controls[node] != tree.controls[parent]).any()
            lasts[node] = 1 if begun[node] else lasts[parent] + 1
        continued = {int(tree.parents[node]) for node in range(1, len(tree)) if not begun[node]}
        lengths = np.array([lasts[node] for node in range(1, len(tree) - 200) if node not in continued])
        assert set(lengths) == {2, 3, 4}
        assert np.bincount(lengths)[2:] / len(lengths) == pytest.approx(1 / 3, abs=0.06)


@pytest.mark.parametrize("returned", [np.zeros(1, int), np.ones(2, int), np.ones(1), [1]])
def test_bad_durations_of_a_strategy_are_named(solve, square, returned) -> None:
    class Bad(RandomWalk):
        def durations(self, tree, nodes):
            return returned

    planner, _, counter, _ = solve(lambda si: Bad.build(si), square())
    assert counter.count == 0
    with pytest.raises(CallbackFailed, match=r"Bad\.durations returned .* integers \(int64\) above 0"):
        raise planner.error


def test_ompl_keeps_to_the_least_duration() -> None:
    result = plan("pbcs/Maze-v0", "RRT", seed=1, max_transitions=100_000, planner_kwargs={"control_duration": [3, 6]},
                  **MAZE)
    assert result.replay_ok
    assert result.trajectory is not None
    assert min(runs_of(result.trajectory.actions)) >= 3


@pytest.mark.parametrize("planner", ["Ex", "RRT"])
@pytest.mark.parametrize("duration", [0, -1, 1.5, "many", True, [3, 2], [0, 2], [1, 2, 3], [2], 10**12])
def test_bad_lengths_are_refused(planner: str, duration: object) -> None:
    with pytest.raises(InvalidOption, match="control_duration"):
        plan("pbcs/Maze-v0", planner, planner_kwargs={"control_duration": duration})
