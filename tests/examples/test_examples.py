"""Every example runs as its user would run it, in an empty folder, and stays short."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = {
    "moving_picture.py": (["2"], "114 frames"),
    "plan_a_maze.py": ([], "it replays exactly: True"),
    "compare_planners.py": (["2"], "KPIECE1"),
    "train_a_skill_chain.py": ([], "success with 0% random actions: 100%"),
    "own_planner.py": ([], "Nearest: solved True"),
    "own_environment.py": ([], "replays exactly: True"),
    "plain_ompl_car.py": ([], "OMPL's own check: True"),
    "look_at_a_critic.py": (["200"], "critic.png"),
    "stable_baselines_agent.py": ([], "solved: True"),
    "continue_in_stable_baselines.py": (["20", "200"], "success in stable-baselines3: 100%"),
    "ddpg_huber.py": ([], "solved: "),
    "robot_videos.py": (["quadrotor"], "runs/quadrotor.gif"),
    "train_ant_follower.py": (["run", "17000"], "of the test lines after"),
    "train_car_follower.py": (["run", "30000"], "of the test lines after"),
    "train_quadrotor_follower.py": (["run", "30000"], "of the test lines after"),
}


QUICK = ("plan_a_maze.py", "own_planner.py", "own_environment.py")


def test_every_example_is_tested():
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXAMPLES)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow])
                                  for name in EXAMPLES])
def test_example_runs(name, tmp_path):
    if "stable_baselines" in name:
        pytest.importorskip("stable_baselines3")
    if "_ant_" in name:
        pytest.importorskip("mujoco")
    words, expected = EXAMPLES[name]
    command = [sys.executable, ROOT / "examples" / name, *words]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert expected in run.stdout
    assert "Traceback" not in run.stderr


@pytest.mark.parametrize("name", EXAMPLES)
def test_example_is_short(name):
    assert len((ROOT / "examples" / name).read_text().splitlines()) < 100
