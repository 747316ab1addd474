"""How well does a follower of the car or of the quadrotor drive plans among obstacles that it never saw? By the judge.

    python tests/benchmarks/body_follower.py car|quadrotor [--follower FOLDER] [--worlds 40] [--seed 1000]

World k has obstacles as `examples/train_*_follower.py` draws them, from seed + k, a random start and a random goal.
Lines: the plans of Rides and of Ex, improved for a tenth of the search's transitions; for the car that of RidesSST with
twice the transitions; for the quadrotor also smoothed, as `pbcs plan --follow` does it, and the shortest way, which
needs no planner. The start is always the same, so there is one execution without noise, and ten with 10 % random
actions, for each line.
"""

import argparse
import importlib.util
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import pbcs_ompl
from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.evaluation import drive, planned_line, shortest_line, smoothed_line
from pbcs_ompl.skills.robots.follower import RobotFollower

EXAMPLES = Path(__file__).parents[2] / "examples"
APART, BUDGET, EPISODES = 2.5, 300_000, 10
PLANNERS = {"car": {"Rides": "10%", "RidesSST": "100%", "Ex": "10%"}, "quadrotor": {"Rides": "10%", "Ex": "10%"}}
"""What plans, and what it may use beside the search."""


def example(robot: str) -> Any:
    """Return the module of an example."""
    spec = importlib.util.spec_from_file_location(robot, EXAMPLES / f"train_{robot}_follower.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def car_task(drawn: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Return the options of a random environment."""
    options: dict[str, Any] = drawn.world(rng)
    return options


def quadrotor_task(drawn: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Return the options of a random environment, with start and goal in free places that are apart."""
    while True:
        start, goal = rng.uniform(0.5, drawn.EXTENT - 0.5, (2, 2)).round(3)
        options = {"obstacles": drawn.obstacles(rng), "start": [*start.tolist(), 0.0], "goal": goal.tolist()}
        if np.linalg.norm(goal - start) < APART:
            continue
        try:
            gymnasium.make(drawn.ENV, **options)
        except InvalidState:
            continue
        return options


TASKS = {"car": car_task, "quadrotor": quadrotor_task}


def lines(follower: RobotFollower, model: ResettableModel, planners: dict[str, str],
          seed: int) -> Iterator[tuple[str, Line | None]]:
    """Yield each way to the goal with its line; None where there is none, or none that keeps clear of walls."""
    plans = {name: pbcs_ompl.plan(model, name, seed=seed, max_transitions=BUDGET, improve=more).trajectory
             for name, more in planners.items()}
    for name, plan in plans.items():
        yield f"plan of {name}", None if plan is None else planned_line(follower, model, plan)
    if follower.view.robot.turning > 0.0:
        return
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
    parser.add_argument("robot", choices=sorted(TASKS))
    parser.add_argument("--follower", type=Path)
    parser.add_argument("--worlds", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1000)
    given = parser.parse_args()
    follower = (RobotFollower.load(given.follower) if given.follower is not None
                else RobotFollower.shipped(given.robot))
    drawn = example(given.robot)
    found: dict[tuple[str, float], list[int]] = {}
    without: dict[str, int] = {}
    for seed in range(given.seed, given.seed + given.worlds):
        model = pbcs_ompl.make(drawn.ENV, TASKS[given.robot](drawn, np.random.default_rng(seed)))
        for kind, line in lines(follower, model, PLANNERS[given.robot], seed):
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
