"""How well does the quadrotor's follower fly plans among obstacles that it never saw? Executions by the judge.

    python tests/benchmarks/quadrotor_follower.py [FOLLOWER] [--worlds 40] [--seed 1000]

World k has the obstacles that `examples/train_quadrotor_follower.py` draws, from seed + k, a random start and a random
goal at least 2.5 m apart. Lines: the plan of Rides itself, smoothed (as `pbcs plan --follow` does it), that of Ex, and
the shortest way, which needs no planner. The start is always the same, so there is one execution without noise, and ten
with 10 % random actions, for each line.
"""

import argparse
import importlib.util
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import pbcs_ompl
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.evaluation import drive, planned_line, shortest_line, smoothed_line
from pbcs_ompl.skills.robots.follower import RobotFollower

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_quadrotor_follower.py"
APART, BUDGET, EPISODES = 2.5, 300_000, 10


def example() -> Any:
    """Return the module of the example."""
    spec = importlib.util.spec_from_file_location("train_quadrotor_follower", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def model_of(seed: int) -> ResettableModel:
    """Return the first environment that the seed leads to, with start and goal in free places."""
    rng, drawn = np.random.default_rng(seed), example()
    while True:
        start, goal = rng.uniform(0.5, drawn.EXTENT - 0.5, (2, 2)).round(3)
        kwargs = {"obstacles": drawn.obstacles(rng), "start": [*start.tolist(), 0.0], "goal": goal.tolist()}
        if np.linalg.norm(goal - start) < APART:
            continue
        try:
            return pbcs_ompl.make(drawn.ENV, kwargs)
        except InvalidState:
            continue


def lines(follower: RobotFollower, model: ResettableModel, seed: int) -> Iterator[tuple[str, Line | None]]:
    """Yield each way to the goal with its line; None where there is none that keeps clear of walls."""
    plans = {name: pbcs_ompl.plan(model, name, seed=seed, max_transitions=BUDGET, improve="10%").trajectory
             for name in ("Rides", "Ex")}
    for name, plan in plans.items():
        if plan is not None:
            yield f"plan of {name}", planned_line(follower, model, plan)
    for name, make_line in (("smoothed", lambda: smoothed_line(follower, model, plans["Rides"])),
                            ("shortest", lambda: shortest_line(follower, model))):
        try:
            yield name, make_line() if plans["Rides"] is not None else None
        except InvalidState:
            yield name, None


def interval(successes: list[int], episodes: int) -> list[float]:
    """Return the 95 % interval of a rate: Wilson's, or of the bootstrap over worlds, whose executions are alike."""
    if episodes == 1:
        bounds = wilson(sum(successes), len(successes))
    else:
        drawn = np.random.default_rng(0).choice(successes, (2000, len(successes))).mean(axis=1) / episodes
        bounds = tuple(np.quantile(drawn, [0.025, 0.975]).tolist())
    return [round(bound, 3) for bound in bounds]


def main() -> None:
    """Print a line of JSON for each kind of line and noise."""
    parser = argparse.ArgumentParser()
    parser.add_argument("follower", nargs="?", default="quadrotor")
    parser.add_argument("--worlds", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1000)
    given = parser.parse_args()
    follower = (RobotFollower.load(given.follower) if Path(given.follower).is_dir()
                else RobotFollower.shipped(given.follower))
    found: dict[tuple[str, float], list[int]] = {}
    without: dict[str, int] = {}
    for seed in range(given.seed, given.seed + given.worlds):
        model = model_of(seed)
        for kind, line in lines(follower, model, seed):
            if line is None:
                without[kind] = without.get(kind, 0) + 1
                continue
            for noise, episodes in ((0.0, 1), (0.1, EPISODES)):
                one = drive(follower, model, line, episodes=episodes, epsilon=noise, seed=seed)
                found.setdefault((kind, noise), []).append(one.successes)
    for (kind, noise), successes in found.items():
        episodes = EPISODES if noise else 1
        print(json.dumps({"line": kind, "noise": noise, "successes": sum(successes), "of": episodes * len(successes),
                          "no line": without.get(kind, 0), "interval": interval(successes, episodes)}))


if __name__ == "__main__":
    main()
