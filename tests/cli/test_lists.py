"""Planners, agents and settings are listed with defaults and meanings; without torch, what is missing is named."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from pbcs_ompl.cli import main

WITHOUT_TORCH = """
import sys
from importlib.machinery import PathFinder

found = PathFinder.find_spec

def find_spec(name, path=None, target=None):
    return None if name.partition(".")[0] in ("torch", "safetensors", "mujoco") else found(name, path, target)

PathFinder.find_spec = find_spec
from pbcs_ompl.cli import main
sys.exit(main(sys.argv[1:]))
"""


def listed(words: list[str], capsys: pytest.CaptureFixture[str]) -> dict:
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("words", [["planners"], ["agents"], ["settings"], ["settings", "thesis"],
                                   ["settings", "--method", "follow"], ["settings", "--method", "backplay"]])
def test_every_option_has_a_default_and_a_meaning(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    found = listed(words, capsys)
    nameless = [f"{name}.{option}" for name, one in found.items() for option, values in one["options"].items()
                if not values["meaning"]]
    assert found
    assert all(one["about"] for one in found.values())
    assert not nameless


def test_one_of_them_is_shown_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["planners", "Ex"]) == 0
    assert "  control_duration = 1  Steps that a control lasts" in capsys.readouterr().out
    assert main(["settings", "fats"]) == 2
    assert "'fast'" in capsys.readouterr().err


def without_torch(words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", WITHOUT_TORCH, *words], cwd=folder, capture_output=True, text=True)


def test_without_torch_there_are_plans_and_the_rest_is_named(tmp_path: Path) -> None:
    doctor = without_torch(["doctor"], tmp_path)
    assert 'pip install "pbcs-ompl[rl]"' in doctor.stdout
    demo = without_torch(["demo", "--out", "demo"], tmp_path)
    assert demo.returncode == 0, demo.stderr
    assert 'pip install "pbcs-ompl[rl]"' in demo.stderr
    assert (tmp_path / "demo/tree.png").is_file()
    viewed = without_torch(["view", "demo"], tmp_path)
    assert viewed.returncode == (0 if find_spec("viser") else 3), viewed.stderr
    compared = without_torch(["compare", "--planners", "Ex", "--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}',
                              "--seeds", "1"], tmp_path)
    assert compared.returncode == 0, compared.stderr
    for words in (["agents"], ["settings"], ["train", "--env", "pbcs/Maze-v0"],
                  ["export", "demo", "--to", "onnx"]):
        run = without_torch(words, tmp_path)
        assert (run.returncode == 3) == (words != ["agents"]), f"{words}: {run.stderr}"
        assert 'pip install "pbcs-ompl[rl]"' in run.stdout + run.stderr, f"{words}: {run.stderr}"
        assert "Traceback" not in run.stderr
