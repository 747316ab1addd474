"""Who finds the way: planners on mazes of several sizes, PBCS on the smallest."""

import pytest

from pbcs_ompl.bridge.plan import plan

SEEDS = range(6)
BUDGETS = {2: 20_000, 3: 60_000, 5: 200_000}
EXPECTED = {"Ex": 6, "RRTNH": 6, "RRTSteered": 6, "ESTAdapted": 5, "RRT": 5, "EST": 5, "KPIECE1": 5}


@pytest.mark.parametrize("size", BUDGETS)
@pytest.mark.parametrize("planner", EXPECTED)
def test_planner_solves_mazes(planner, size, record_property):
    results = [plan("pbcs/Maze-v0", planner, env_kwargs={"size": size, "maze_seed": seed}, seed=seed,
                    max_transitions=BUDGETS[size]) for seed in SEEDS]
    solved = sum(result.solved for result in results)
    record_property("solve_rate", [planner, size, solved, len(SEEDS)])
    assert all(result.replay_ok for result in results if result.solved)
    assert solved >= EXPECTED[planner]


def test_random_walk_is_no_planner(record_property):
    """The floor of the table: what exploration without a tree is worth."""
    solved = sum(plan("pbcs/Maze-v0", "RandomWalk", env_kwargs={"size": 5, "maze_seed": seed}, seed=seed,
                      max_transitions=20_000).solved for seed in SEEDS)
    record_property("solve_rate", ["RandomWalk", 5, solved, len(SEEDS)])
    assert solved < len(SEEDS)


@pytest.mark.parametrize("seed", [0])
def test_pbcs_solves_the_smallest_maze(seed, record_property):
    from pbcs_ompl.skills import train

    seeds = range(3)
    results = [train("pbcs/Maze-v0", env_kwargs={"size": 2}, seed=seed) for seed in seeds]
    solved = sum(result.solved for result in results)
    record_property("solve_rate", ["PBCS", 2, solved, len(seeds)])
    assert solved == len(seeds)
