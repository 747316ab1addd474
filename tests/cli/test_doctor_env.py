"""What `pbcs doctor --env` and the rules on the command line say."""

import json
import shlex
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.cli.models import note_rules
from pbcs_ompl.resettable import adapt
from pbcs_ompl.results.files import read_toml


def last_json(capsys: pytest.CaptureFixture[str]) -> dict:
    return json.loads(capsys.readouterr().out.splitlines()[-1])


def test_the_doctor_reports_what_an_environment_can_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(shlex.split("doctor --env MountainCarContinuous-v0 --json")) == 0
    found = last_json(capsys)["environment"]
    assert found["ok"]
    assert found["capabilities"] == ["exact", "visited"]
    assert found["feature"].endswith("from the observation space")


def test_rules_go_where_the_plan_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    words = "plan --env Pendulum-v1 --goal 'obs[0]>0.99' --feature state --start-seed 3 --out found --json"
    assert main(shlex.split(words)) == 0
    captured = capsys.readouterr()
    assert "goal      obs[0]>0.99" in captured.err
    assert "random steps, widened" in captured.err
    assert json.loads(captured.out.splitlines()[-1])["replay_ok"]
    assert read_toml(tmp_path / "found/config.toml")["environment"] == {
        "id": "Pendulum-v1", "kwargs": {}, "goal": "obs[0]>0.99", "feature": "state", "start_seed": 3}


@pytest.mark.parametrize(("numbers", "rule", "hint"), [(4, None, True), (3, None, False), (4, "obs[0:4]", False)])
def test_many_numbers_to_explore_are_worth_a_hint(numbers: int, rule: str | None, hint: bool,
                                                  capsys: pytest.CaptureFixture[str]) -> None:
    class Point(gymnasium.Env):
        action_space = observation_space = gymnasium.spaces.Box(-1.0, 1.0, (numbers,), np.float64)

        def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
            super().reset(seed=seed)
            self.place = np.zeros(numbers)
            return -self.place, {}

        def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
            self.place = np.clip(self.place + 0.1 * action, -1.0, 1.0)
            return -self.place, 0.0, False, False, {}

        def get_env_state(self) -> np.ndarray:
            return self.place.copy()

        def set_env_state(self, state: np.ndarray) -> None:
            self.place = np.array(state)

    note_rules(adapt(Point(), feature=rule))
    assert ("numbers are explored" in capsys.readouterr().err) == hint


def test_a_process_without_mujoco(tmp_path: Path) -> None:
    code = ("import sys; sys.modules['mujoco'] = None\n"
            "from pbcs_ompl.cli import main\n"
            "assert main(['plan', '--env', 'pbcs/AntMaze-v0']) == 3\n"
            "assert main(['plan', '--env', 'Ant-v5']) == 3\n"
            "assert main(['plan', '--env', 'pbcs/Maze-v0']) == 0\n")
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "pip install 'pbcs-ompl[mujoco]'" in done.stderr
