"""Train the ant's follower that ships with the package: one policy for any line in any maze, trained once.

Four open squares and twelve mazes; the mazes of the tables in docs/skills.md are others. Euler's integration takes a
quarter of the time and is the harder physics; the follower drives in RK4 unchanged. The same command continues a
training that was stopped. With --ant d4rl it is D4RL's ant, and the follower `ant-d4rl`.
"""

import argparse
from pathlib import Path

from pbcs_ompl.skills import resume_follower, train_follower

TRAINING = {"integrator": "Euler", "terminate_when_unhealthy": True, "terminate_on_success": False, "threads": 1}
WORLDS = [*[{"map": "open", "size": 8}] * 4, *[{"size": 4 + k % 2, "maze_seed": 100 + k} for k in range(12)]]
TRANSITIONS = 1_937_171
"""Those of the follower that ships; a larger budget continues its training."""


def main(out: str, transitions: int, ant: str, seed: int) -> None:
    """Train in a new folder, or continue in one; then say how good the test was."""
    if (Path(out) / "config.toml").is_file():
        result = resume_follower(out, max_transitions=transitions, on_progress=print)
    else:
        result = train_follower("pbcs/AntMaze-v0", env_kwargs={**TRAINING, "ant": ant}, worlds=WORLDS, seed=seed,
                                max_transitions=transitions, out=out, on_progress=print)
    print(f"{result.test_rate:.0%} of the test lines after {result.transitions:,} transitions")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("out", nargs="?", default="runs/ant-follower")
    parser.add_argument("transitions", nargs="?", type=int, default=TRANSITIONS)
    parser.add_argument("--ant", default="gymnasium", help="gymnasium or d4rl")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    main(given.out, given.transitions, given.ant, given.seed)
