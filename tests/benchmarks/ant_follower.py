"""How well an ant's follower drives in mazes that it never saw, without any training there: executions by the judge.

    python tests/benchmarks/ant_follower.py runs/ant-follower/follower --noise 0 0.1 --episodes 10

Mazes of `pbcs/AntMaze-v0` (RK4, no end when unhealthy, goal radius 0.8 m) with seeds from 500 on, shortest ways; its
official maps (0.45 m); with --robotics those of gymnasium-robotics under their own ids, with the starts and goals that
their resets draw (Gymnasium's ant only). With --planners Ex Rides each maze is planned in as well, and the smoothed
plans are followed, as `pbcs plan --follow` does.
"""

import argparse
import json
from collections.abc import Iterator

import numpy as np

import pbcs_ompl
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.envs.maze_maps import MazeMap
from pbcs_ompl.skills import RobotFollower
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.evaluation import drive, shortest_line, smoothed_line
from pbcs_ompl.skills.robots.free_space import FreeSpace

CELL = 4.0
OFFICIAL = {"umaze": "AntMaze_UMaze-v5", "medium": "AntMaze_Medium-v5", "large": "AntMaze_Large-v5"}
THEIR_ENTRIES = [0, 1, *range(4, 31)]
"""Of their observation (achieved goal, desired goal, observation): qpos and qvel."""


def mazes(sizes: list[int], count: int) -> Iterator[tuple[str, dict]]:
    """Names and options of mazes; those of 2x2 and 3x3 do not depend on a seed."""
    for size in sizes:
        for seed in range(500, 500 + (1 if size < 4 else count)):
            yield f"{size}x{size}", {"size": size, "maze_seed": seed}
    if not sizes:
        return
    for name in OFFICIAL:
        yield f"map {name}", {"map": name, "goal_radius": 0.45}


def robotics_line(follower: RobotFollower, name: str, observation: np.ndarray) -> Line:
    """The shortest way from start to goal of a reset of gymnasium-robotics, whose origin is the middle of the map."""
    layout = MazeMap.named(name)
    middle = CELL * np.array(layout.extent) / 2
    space = FreeSpace(layout.walls * CELL - np.tile(middle, 2), -middle, middle, follower.clearance)
    return space.line_between(observation[0:2], observation[2:4], follower.spacing)


def planned(follower: RobotFollower, model: ResettableModel, planner: str, max_transitions: int) -> Line | None:
    """Return the smoothed line of a plan, whose costs are printed; None where there is no plan within the budget."""
    found = plan(model, planner, planner_kwargs={"control_duration": 10} if planner == "Ex" else {},
                 max_transitions=max_transitions)
    line = None if found.trajectory is None else smoothed_line(follower, model, found.trajectory)
    print(json.dumps({"maze": model.spec.label, "planner": planner, "transitions": found.transitions,
                      "seconds": round(found.seconds, 1), "metres": None if line is None else round(line.length, 1)}),
          flush=True)
    return line


def main() -> None:
    """Print a line of JSON for each maze and noise, then one for each size."""
    parser = argparse.ArgumentParser()
    parser.add_argument("follower")
    parser.add_argument("--noise", type=float, nargs="+", default=[0.0, 0.1])
    parser.add_argument("--sizes", type=int, nargs="*", default=[2, 3, 4, 5, 6])
    parser.add_argument("--mazes", type=int, default=5)
    parser.add_argument("--episodes", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="of the executions; resets of gymnasium-robotics count on "
                                                            "from 700 more")
    parser.add_argument("--planners", nargs="*", default=[], help="whose plans are followed, beside shortest ways")
    parser.add_argument("--planned", type=int, default=5, help="mazes of each size that are planned in")
    parser.add_argument("--max-transitions", type=int, default=3_000_000, help="of a plan")
    parser.add_argument("--robotics", type=int, default=0, help="resets of each map of gymnasium-robotics")
    given = parser.parse_args()
    follower, total = RobotFollower.load(given.follower), {}
    own = {"threads": 1, "ant": follower.environment.kwargs.get("ant", "gymnasium")}

    def count(group: str, noise: float, name: str, line: Line, found: pbcs_ompl.Evaluation) -> None:
        successes, episodes = total.get((group, noise), (0, 0))
        total[group, noise] = successes + found.successes, episodes + found.episodes
        print(json.dumps({"maze": name, "noise": noise, "metres": round(line.length, 1), "of": found.episodes,
                          "successes": found.successes, "steps": found.steps_median, "endings": found.endings}),
              flush=True)

    tasks = [(group, str(options), model, shortest_line(follower, model))
             for group, options in mazes(given.sizes, given.mazes)
             for model in [pbcs_ompl.make("pbcs/AntMaze-v0", {**options, **own})]]
    for planner in given.planners:
        for group, options in mazes(given.sizes, given.planned):
            model = pbcs_ompl.make("pbcs/AntMaze-v0", {**options, **own})
            line = planned(follower, model, planner, given.max_transitions)
            if line is not None:
                tasks.append((f"{group} along {planner}", str(options), model, line))
    for noise in given.noise:
        for group, name, model, line in tasks:
            count(group, noise, name, line, drive(
                follower, model, line, episodes=given.episodes, epsilon=noise, seed=given.seed))
        for name, env_id in OFFICIAL.items():
            for seed in range(given.seed, given.seed + given.robotics):
                model = pbcs_ompl.make(env_id, start_seed=700 + seed)
                line = robotics_line(follower, name, model.observe(model.initial_state()[None])[0])
                count(env_id, noise, f"{env_id} {seed}", line, drive(
                    follower, model, line, episodes=1, epsilon=noise, seed=seed, entries=THEIR_ENTRIES))
    for (group, noise), (successes, episodes) in total.items():
        print(json.dumps({"group": group, "noise": noise, "successes": successes, "of": episodes,
                          "wilson": [round(bound, 3) for bound in wilson(successes, episodes)]}), flush=True)


if __name__ == "__main__":
    main()
