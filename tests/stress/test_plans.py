"""Over a thousand plans in fifteen environments: what is called solved, a loop over `env.step` reaches.

The plans are made in one process for each environment, and executed in another one, by code without the toolkit.
PLANS=N changes their number.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
NUMBER = int(os.environ.get("PLANS", "1300"))
ROBOTICS = {"modules": ["gymnasium_robotics"]}
TASKS: list[dict[str, Any]] = [
    {"id": "pbcs/Maze-v0", "kwargs": {"size": 2}}, {"id": "pbcs/Maze-v0", "kwargs": {"size": 3}},
    {"id": "pbcs/Maze-v0", "kwargs": {"size": 4, "collision_response": "slide"}},
    {"id": "pbcs/Maze-v0", "kwargs": {"size": 2, "normalize_actions": True, "wall_penalty": -1.0}},
    {"id": "pbcs/Box-v0", "kwargs": {"goal": [3.5, 3.5]}}, {"id": "pbcs/Disc-v0", "kwargs": {"goal": [2.2, 2.2]}},
    {"id": "pbcs/Toy1D-v0"}, {"id": "MountainCarContinuous-v0", "budget": 20_000},
    {"id": "MountainCar-v0", "goal": "obs[0]>-0.3", "check": "obs0>-0.3"},
    {"id": "CartPole-v1", "goal": "obs[0]>0.2", "check": "obs0>0.2"},
    {"id": "Acrobot-v1", "goal": "obs[0]<0", "check": "obs0<0"},
    {"id": "Pendulum-v1", "goal": "obs[0]<0", "check": "obs0<0"},
    {"id": "PointMaze_UMaze-v3", **ROBOTICS},
    {"id": "InvertedPendulum-v5", "goal": "qpos[0]>0.05", "check": "qpos0>0.05"},
    {"id": "Hopper-v5", "goal": "qpos[0]>0.05", "check": "qpos0>0.05"},
    {"id": "Walker2d-v5", "goal": "qpos[0]>0.05", "check": "qpos0>0.05"},
    {"id": "HalfCheetah-v5", "goal": "qpos[0]>0.05", "check": "qpos0>0.05"},
    {"id": "Swimmer-v5", "goal": "qpos[0]>0.05", "check": "qpos0>0.05"},
]


def output(script: str, *arguments: str) -> dict[str, Any]:
    """Return the JSON that a script prints in a process of its own."""
    done = subprocess.run([sys.executable, str(HERE / script), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    values: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return values


def name(task: dict[str, Any]) -> str:
    return task["id"] + "".join(map(str, task.get("kwargs", {}).values()))


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("task", TASKS, ids=name)
def test_what_is_called_solved_is_reached_by_a_loop_over_step(task: dict[str, Any], tmp_path: Path) -> None:
    if task.get("modules") or task["id"].endswith("-v5"):
        pytest.importorskip("gymnasium_robotics")
    text = json.dumps(task)
    count = -(-NUMBER // len(TASKS))
    made = output("plans_of.py", str(tmp_path), text, str(count))
    executed = output("executed.py", str(tmp_path), text)
    print(f"{task['id']}: {made}, {executed}")
    assert executed["executed"] == made["solved"]
    assert made["solved"] > 0
    assert executed["refused"] == []
