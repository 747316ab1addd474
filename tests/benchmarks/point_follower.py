"""How well a point's follower drives through mazes that it never saw, without training there: executions by the judge.

    python tests/benchmarks/point_follower.py --transitions 240000

Trained in one maze of 3x3 and two of 4x4; driven in five mazes of each size (seeds 500 to 504), by the shortest way.
"""

import argparse
import json
import time

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.skills import evaluate_follower, train_follower

SETTINGS = {"lines_per_world": 20, "tests_per_world": 5, "longest": 6.0, "clearance": 0.1, "near": 0.1, "middle": 0.2,
            "far": 0.4, "window": 0.3, "goal_radius": 0.15, "patience": 15, "max_steps": 150, "advance": 0.5,
            "test_transitions": 20_000, "test_steps": 400, "effort": 0.0}
"""Lengths for a point that moves 0.1 in a step."""
AGENT = {"hidden": [32, 32], "initial_std": 0.4}
WORLDS = [{"size": 3}, {"size": 4, "maze_seed": 5}, {"size": 4, "maze_seed": 6}]


def main() -> None:
    """Print a line of JSON for each training seed, size and noise."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--transitions", type=int, default=240_000)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--sizes", type=int, nargs="+", default=[5, 10, 15])
    given = parser.parse_args()
    for seed in given.seeds:
        began = time.process_time()
        result = train_follower("pbcs/Maze-v0", worlds=WORLDS, settings=SETTINGS, agent_settings=AGENT, seed=seed,
                                max_transitions=given.transitions)
        seconds = time.process_time() - began
        for size in given.sizes:
            for noise, episodes in ((0.0, 1), (0.1, 20)):
                mazes = [{"size": size, "maze_seed": number} for number in range(500, 505)]
                found = [evaluate_follower(result.follower, "pbcs/Maze-v0", env_kwargs=maze, episodes=episodes,
                                           epsilon=noise, seed=1000) for maze in mazes]
                successes, count = sum(one.successes for one in found), sum(one.episodes for one in found)
                print(json.dumps({"seed": seed, "cpu_seconds": round(seconds, 1), "test": round(result.test_rate, 2),
                                  "size": size, "noise": noise, "successes": successes, "of": count,
                                  "wilson": [round(bound, 3) for bound in wilson(successes, count)]}), flush=True)


if __name__ == "__main__":
    main()
