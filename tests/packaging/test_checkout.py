"""The folders of the checkout: `planners` and `envs` are the same modules under either name."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_planners_and_envs_of_the_checkout_are_those_of_the_package() -> None:
    code = ("import planners, planners.ex, envs.maze.maze, pbcs_ompl.planners.ex, pbcs_ompl.envs.maze.maze\n"
            "from planners.kernels import bin_queue\n"
            "assert planners is pbcs_ompl.planners and planners.Ex is pbcs_ompl.planners.Ex\n"
            "assert planners.ex is pbcs_ompl.planners.ex\n"
            "assert envs.maze.maze is pbcs_ompl.envs.maze.maze\n"
            "assert planners.ex.__spec__.name == 'pbcs_ompl.planners.ex'\n")
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
