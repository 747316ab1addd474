"""Train the quadrotor's follower that ships with the package: one policy for any line among any obstacles.

A minute of one core. It is trained in random worlds; those of the tables in docs/benchmarks.md are others.
"""

import argparse
from typing import Any

import gymnasium
import numpy as np

import pbcs_ompl.envs  # noqa: F401 - registers the environments
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.skills import train_follower

ENV, EXTENT = "pbcs/PlanarQuadrotor-v0", 6.0
CORNERS = [(1.0, 1.0), (5.0, 5.0), (1.0, 5.0), (5.0, 1.0), (3.0, 3.0)]
SETTINGS = {"lines_per_world": 20, "tests_per_world": 3, "longest": 9.0, "clearance": 0.35, "near": 0.3, "middle": 0.8,
            "far": 2.0, "window": 0.5, "goal_radius": 0.35, "patience": 25, "max_steps": 300, "advance": 0.6,
            "stumbles": 20, "test_steps": 600, "effort": 0.0, "stray_cost": 1.0, "crash_cost": 20.0,
            "progress_length": 8.0}
"""Lengths for a bar of 0.6 m that flies at 1 to 3 m/s, 20 steps a second. It sees no walls, so straying has to cost."""
AGENT = {"hidden": [64, 64], "initial_std": 0.4}
WORLDS, TRANSITIONS = 24, 2_000_000


def obstacles(rng: np.random.Generator) -> list[list[float]]:
    """Return two to four rectangles: walls from the floor or the ceiling, and blocks anywhere."""
    found = []
    for _ in range(int(rng.integers(2, 5))):
        if rng.random() < 0.6:
            x, height, width = rng.uniform(1.0, 4.8), rng.uniform(1.0, 3.6), rng.uniform(0.15, 0.5)
            low = 0.0 if rng.random() < 0.5 else EXTENT - height
            found.append([x, low, x + width, low + height])
        else:
            width, height = rng.uniform(0.3, 1.5, 2)
            x, low = rng.uniform(0.0, EXTENT - width), rng.uniform(0.0, EXTENT - height)
            found.append([x, low, x + width, low + height])
    return np.round(found, 3).tolist()


def worlds(count: int, seed: int) -> list[dict[str, Any]]:
    """Return the options of environments with random obstacles, in which one of the CORNERS is free."""
    rng, found = np.random.default_rng(seed), list[dict[str, Any]]()
    while len(found) < count:
        walls = obstacles(rng)
        for corner in CORNERS:
            world = {"obstacles": walls, "start": [*corner, 0.0], "goal": list(corner), "terminate_on_success": False}
            try:
                gymnasium.make(ENV, **world)
            except InvalidState:
                continue
            found.append(world)
            break
    return found


def main(out: str, transitions: int, seed: int) -> None:
    """Train in a new folder; then say how good the test was."""
    result = train_follower(ENV, worlds=worlds(WORLDS, 0), settings=SETTINGS, agent_settings=AGENT, seed=seed,
                            max_transitions=transitions, out=out, on_progress=print)
    print(f"{result.test_rate:.0%} of the test lines after {result.transitions:,} transitions")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("out", nargs="?", default="runs/quadrotor-follower")
    parser.add_argument("transitions", nargs="?", type=int, default=TRANSITIONS)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    main(given.out, given.transitions, given.seed)
