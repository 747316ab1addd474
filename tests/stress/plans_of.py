"""Plans in one environment, kept as trajectories: a process of its own. Arguments: folder, task as JSON, seeds."""

import json
import sys
import warnings
from pathlib import Path

import pbcs_ompl

PLANNERS = ("Ex", "RRTNH", "KPIECE1", "RRT")


def main(folder: Path, task: dict[str, object], seeds: range) -> None:
    """Plan with each seed, and write what is called solved, with its number of steps."""
    warnings.simplefilter("ignore")
    found = solved = 0
    for seed in seeds:
        env = pbcs_ompl.EnvSpec(task["id"], task.get("kwargs", {}), goal=task.get("goal"))
        result = pbcs_ompl.plan(env, PLANNERS[seed % len(PLANNERS)], seed=seed,
                                max_transitions=task.get("budget", 4_000))
        found += result.found
        solved += result.solved
        if result.solved:
            result.trajectory.save(folder / f"{seed}.npz")
    print(json.dumps({"plans": len(seeds), "found": found, "solved": solved}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.loads(sys.argv[2]), range(int(sys.argv[3])))
