"""Planners, agents and settings are listed with defaults and meanings; without torch, what is missing is named."""

import json
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from pbcs_ompl.cli import main

WITHOUT_TORCH = """
import contextlib, io, json, sys
from importlib.machinery import PathFinder

found = PathFinder.find_spec

def find_spec(name, path=None, target=None):
    return None if name.partition(".")[0] in ("torch", "safetensors", "mujoco") else found(name, path, target)

PathFinder.find_spec = find_spec
from pbcs_ompl.cli import main
ends = []
for words in json.loads(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        status = main(words)
    ends.append([status, out.getvalue() + err.getvalue()])
print(json.dumps(ends))
"""
COMMAND = 'pip install "pbcs-ompl[rl]"'


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


def without_torch(lines: list[str], folder: Path) -> list[tuple[int, str]]:
    """Return status and output of commands, one after the other in a process that cannot import torch."""
    run = subprocess.run([sys.executable, "-c", WITHOUT_TORCH, json.dumps([shlex.split(line) for line in lines])],
                         cwd=folder, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return [tuple(end) for end in json.loads(run.stdout.splitlines()[-1])]


@pytest.mark.slow
def test_without_torch_there_are_plans_and_the_rest_is_named(tmp_path: Path) -> None:
    works = ["demo --out demo", "compare --planners Ex --env pbcs/Maze-v0 --env-kwargs '{\"size\": 2}' --seeds 1",
             "report .", "study ex-settings --emit make --out study", "view demo"]
    refused = ["settings", "train --env pbcs/Maze-v0", "study deadlock", "export demo --to onnx"]
    *ends, doctor, agents = without_torch([*works, *refused, "doctor", "agents"], tmp_path)
    for line, (status, text) in zip(works, ends, strict=False):
        assert status == (3 if line == "view demo" and find_spec("viser") is None else 0), f"{line}: {text}"
    for line, (status, text) in zip(refused, ends[len(works):], strict=True):
        assert (status, COMMAND in text, "Traceback" in text) == (3, True, False), f"{line}: {text}"
    assert (tmp_path / "demo/tree.png").is_file()
    assert COMMAND in ends[0][1]
    assert COMMAND in doctor[1]
    assert COMMAND in agents[1]
