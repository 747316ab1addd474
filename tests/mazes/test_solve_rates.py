"""Who finds the way: planners on mazes of several sizes, PBCS on the smallest."""

import pytest

from pbcs_ompl.skills import train

SEEDS = range(6)
BUDGETS = {2: 20_000, 3: 60_000, 5: 200_000}
RELIABLE = ["Ex", "RRTNH", "RRTSteered", "RRT", "EST", "KPIECE1"]


@pytest.mark.parametrize("size", BUDGETS)
@pytest.mark.parametrize("planner", RELIABLE)
def test_planner_solves_mazes(planner, size, solve_rate):
    for_each_maze(solve_rate, planner, size, BUDGETS[size], at_least=len(SEEDS) - 1)


def test_est_adapted_solves_the_smallest_mazes(solve_rate):
    for_each_maze(solve_rate, "ESTAdapted", 2, 4 * BUDGETS[2], at_least=len(SEEDS) // 2)


def test_random_walk_does_without_a_tree(solve_rate):
    """The floor of the table."""
    rate = for_each_maze(solve_rate, "RandomWalk", 5, 20_000, at_least=0)
    assert rate.solved < len(SEEDS)


def for_each_maze(solve_rate, planner, size, budget, at_least):
    """One seed of the planner in one maze of this size (3x3 and smaller ones are always the same)."""
    return solve_rate(planner, "pbcs/Maze-v0", {"size": size, "maze_seed": 1}, where=f"{size}x{size}", seeds=SEEDS,
                      at_least=at_least, max_transitions=budget)


@pytest.mark.parametrize(("size", "runs"), [(2, 3), (3, 2), (5, 1)])
def test_pbcs_solves_small_mazes(size, runs, record_property):
    results = [train("pbcs/Maze-v0", env_kwargs={"size": size}, seed=seed) for seed in range(runs)]
    solved = sum(result.solved for result in results)
    record_property("solve_rate", ["PBCS", f"{size}x{size}", solved, runs])
    assert solved == runs
