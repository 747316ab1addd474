"""MuJoCo's ant along a single plan, trained from scratch: PPO on the follower's task, and path following off-policy.

    python tests/benchmarks/ant_one_plan.py --seeds 220 221 222 223 224 --transitions 1500000
    python tests/benchmarks/ant_one_plan.py --seeds 220 221 --agents td3 sac --critics 2 10 --transitions 400000

Each seed has a plan of Ex in the 2x2 maze, with controls held for 1 to 10 steps. PPO learns as in the training of
a follower, along that line alone, in Euler's integration. TD3 and SAC learn by `pbcs_ompl.train(method="follow")`, in
the environment itself (RK4). Prints a line of JSON for each test and each training, executions by the judge.
"""

import argparse
import json
import time
from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

import pbcs_ompl
from pbcs_ompl.agents.ppo import PPOSettings
from pbcs_ompl.agents.update import one_thread
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.resettable import make
from pbcs_ompl.skills import RobotFollower
from pbcs_ompl.skills.path_following.line import Line, erase_loops
from pbcs_ompl.skills.robots.evaluation import drive
from pbcs_ompl.skills.robots.lines import Lines
from pbcs_ompl.skills.robots.settings import RobotSettings
from pbcs_ompl.skills.robots.training import RobotTraining
from pbcs_ompl.skills.robots.worlds import Worlds, free_space, robot_of, wide_pointers

ID, MAZE = "pbcs/AntMaze-v0", {"size": 2}
TRAINING = {"integrator": "Euler", "terminate_when_unhealthy": True, "terminate_on_success": False, "threads": 1}
NOISES = (0.0, 0.1)
LOOP = 0.5
"""Longest hop in m that leaves a loop of the plan out."""


def planned(seed: int) -> Trajectory:
    """A plan in the 2x2 maze whose ant stays upright."""
    result = plan(ID, "Ex", env_kwargs=MAZE | {"terminate_when_unhealthy": True}, seed=seed,
                  planner_kwargs={"control_duration": 10})
    if result.trajectory is None:
        raise SystemExit(f"seed {seed}: no plan")
    return result.trajectory


def line_along(trajectory: Trajectory, settings: RobotSettings) -> Line:
    """The line of a plan without its loops, to the middle of the goal."""
    model = make(ID, MAZE)
    assert model.goal_circle is not None
    places = np.concatenate([model.observe(trajectory.states)[:, list(robot_of(model).place)],
                             [model.goal_circle[:2]]])
    return Line.through(places[erase_loops(places, LOOP)], settings.lines.spacing)


def along_line(line: Line, settings: RobotSettings, seed: int) -> RobotTraining:
    """The training of a follower on one line."""
    model = make(ID, MAZE | TRAINING)
    wide = wide_pointers(free_space(model, settings.lines.clearance), line.points)
    worlds = Worlds((model,), robot_of(model), Lines.of([line, line]), np.zeros(2, dtype=np.int64), 1, (wide, wide))
    return RobotTraining(worlds, settings, PPOSettings(), seed)


def rates(follower: RobotFollower, line: Line, episodes: int) -> dict[str, list[int]]:
    """Executions that reach the goal, of how many, by noise."""
    done = {noise: drive(follower, make(ID, MAZE), line, episodes=episodes, epsilon=noise, seed=1) for noise in NOISES}
    return {f"{noise:.0%} random": [round(result.success_rate * episodes), episodes] for noise, result in done.items()}


def by_ppo(trajectory: Trajectory, seed: int, transitions: int, every: int) -> Iterator[dict[str, Any]]:
    """Train along the line of a plan; yield what is reached after each `every` transitions."""
    settings = RobotSettings()
    line = line_along(trajectory, settings)
    yield {"line": round(line.length, 1), "plan_steps": len(trajectory.states) - 1}
    training, due, spent, began = along_line(line, settings, seed), every, 0.0, time.process_time()
    while training.transitions < transitions:
        if training.transitions >= training.next_test:
            training.test(transitions)
        training.iterate()
        if training.transitions >= due or training.transitions >= transitions:
            due, spent = due + every, spent + time.process_time() - began
            model = training.worlds.models[0]
            follower = RobotFollower(training.agent.policy(), training.view, model.spec,
                                     model.actions,  # type: ignore[attr-defined]
                                     settings.lines.spacing, settings.lines.clearance, {})
            last = training.transitions >= transitions
            yield {"transitions": training.transitions, "cpu_seconds": round(spent),
                   **rates(follower, line, 100 if last else 20)}
            began = time.process_time()


def by_following(trajectory: Trajectory, seed: int, transitions: int, agent: str, critics: int) -> dict[str, Any]:
    """Train by path following with an off-policy agent."""
    began = time.process_time()
    result = pbcs_ompl.train(ID, env_kwargs=MAZE | {"terminate_when_unhealthy": True}, trajectory=trajectory,
                             method="follow", agent=agent, seed=seed, max_transitions=transitions,
                             agent_settings={"hidden": [128, 128], "layer_norm": True, "critics": critics,
                                             "discount": 0.99})
    robust = None if result.robust is None else [round(result.robust.success_rate * result.robust.episodes),
                                                 result.robust.episodes]
    return {"agent": agent, "critics": critics, "transitions": result.train_transitions, "solved": result.solved,
            "10% random": robust, "reason": result.reason, "cpu_seconds": round(time.process_time() - began)}


def main() -> None:
    """Print a line of JSON for each result."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, nargs="+", default=[220, 221, 222, 223, 224])
    parser.add_argument("--transitions", type=int, default=1_500_000)
    parser.add_argument("--every", type=int, default=500_000)
    parser.add_argument("--agents", nargs="*", default=[], help="td3, sac: path following instead of PPO")
    parser.add_argument("--critics", type=int, nargs="+", default=[2, 10])
    given = parser.parse_args()
    with one_thread():
        for seed in given.seeds:
            trajectory = planned(seed)
            for agent, critics in product(given.agents, given.critics):
                report(seed, by_following(trajectory, seed, given.transitions, agent, critics))
            if not given.agents:
                for record in by_ppo(trajectory, seed, given.transitions, given.every):
                    report(seed, record)


def report(seed: int, record: dict[str, Any]) -> None:
    """Print a line of JSON."""
    print(json.dumps({"seed": seed, **record}), flush=True)


if __name__ == "__main__":
    main()
