"""Train the car's follower that ships with the package: one policy for any plan of a car, among any obstacles.

Three minutes of one core. Its lines are branches of trees that Rides grows in random worlds, since a car cannot drive
along any line; the worlds of the tables in docs/benchmarks.md are others.
"""

import argparse
from typing import Any

import gymnasium
import numpy as np

import pbcs_ompl.envs  # noqa: F401 - registers the environments
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.skills import train_follower

ENV, EXTENT, APART = "pbcs/CarPark-v0", 8.0, 3.0
SETTINGS = {"lines_per_world": 20, "tests_per_world": 2, "longest": 14.0, "clearance": 0.2, "near": 0.3, "middle": 0.8,
            "far": 2.0, "window": 0.5, "goal_radius": 0.2, "patience": 40, "max_steps": 200, "advance": 0.6,
            "stumbles": 15, "stalled": 0.25, "test_steps": 400, "effort": 0.0, "stray_cost": 0.5,
            "progress_length": 8.0}
"""Lengths for a car of 1 m by 0.5 m that drives at up to 2 m/s, ten steps a second; a radian counts 0.88 m."""
AGENT = {"hidden": [128, 128], "initial_std": 0.5, "smallest_std": 0.35}
"""A car that touches a wall, which it does not see, has to try what frees it: actions vary to the end."""
WORLDS, TRANSITIONS = 64, 1_500_000


def obstacles(rng: np.random.Generator) -> list[list[float]]:
    """Return two to five rectangles: walls along the axes, and blocks."""
    found = []
    for _ in range(int(rng.integers(2, 6))):
        edges = rng.uniform(0.3, 1.5, 2) if rng.random() < 0.5 else rng.permutation([rng.uniform(2.0, 5.0), 0.3])
        low = rng.uniform(0.0, EXTENT - edges)
        found.append([*low, *(low + edges)])
    return np.round(found, 3).tolist()


def world(rng: np.random.Generator) -> dict[str, Any]:
    """Return the options of a random world, with start and goal in free places that are apart."""
    while True:
        start, goal = rng.uniform([0.7, 0.7, -np.pi], [EXTENT - 0.7, EXTENT - 0.7, np.pi], (2, 3)).round(3)
        options = {"obstacles": obstacles(rng), "start": start.tolist(), "goal": goal.tolist()}
        if np.linalg.norm((goal - start)[:2]) < APART:
            continue
        try:
            gymnasium.make(ENV, **options)
        except InvalidState:
            continue
        return options


def main(out: str, transitions: int, seed: int) -> None:
    """Train in a new folder; then say how good the test was."""
    rng = np.random.default_rng(0)
    worlds = [world(rng) | {"terminate_on_success": False} for _ in range(WORLDS)]
    result = train_follower(ENV, worlds=worlds, settings=SETTINGS, agent_settings=AGENT, seed=seed,
                            max_transitions=transitions, out=out, on_progress=print)
    print(f"{result.test_rate:.0%} of the test lines after {result.transitions:,} transitions")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("out", nargs="?", default="runs/car-follower")
    parser.add_argument("transitions", nargs="?", type=int, default=TRANSITIONS)
    parser.add_argument("--seed", type=int, default=1, help="1 is that of the follower that ships")
    given = parser.parse_args()
    main(given.out, given.transitions, given.seed)
