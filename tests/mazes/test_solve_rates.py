"""Who finds the way: planners on mazes of several sizes, PBCS on the smallest."""

import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.skills import train

SEEDS = range(6)
BUDGETS = {2: 20_000, 3: 60_000, 5: 200_000}
RELIABLE = ["Ex", "RRTNH", "RRTSteered", "RRT", "EST", "KPIECE1"]


def solve(planner, size, budget, record_property):
    """Return how many of the mazes are solved within the budget, and record it for the table."""
    results = [plan("pbcs/Maze-v0", planner, env_kwargs={"size": size, "maze_seed": seed}, seed=seed,
                    max_transitions=budget) for seed in SEEDS]
    solved = sum(result.solved for result in results)
    record_property("solve_rate", [planner, size, solved, len(SEEDS)])
    assert all(result.replay_ok for result in results if result.solved)
    return solved


@pytest.mark.parametrize("size", BUDGETS)
@pytest.mark.parametrize("planner", RELIABLE)
def test_planner_solves_mazes(planner, size, record_property):
    assert solve(planner, size, BUDGETS[size], record_property) >= len(SEEDS) - 1


def test_est_adapted_solves_the_smallest_mazes(record_property):
    assert solve("ESTAdapted", 2, 4 * BUDGETS[2], record_property) >= len(SEEDS) // 2


def test_random_walk_does_without_a_tree(record_property):
    """The floor of the table."""
    assert solve("RandomWalk", 5, 20_000, record_property) < len(SEEDS)


@pytest.mark.parametrize(("size", "runs"), [(2, 6), (3, 3), (5, 2)])
def test_pbcs_solves_small_mazes(size, runs, record_property):
    results = [train("pbcs/Maze-v0", env_kwargs={"size": size}, seed=seed) for seed in range(runs)]
    solved = sum(result.solved for result in results)
    record_property("solve_rate", ["PBCS", size, solved, runs])
    assert solved == runs
