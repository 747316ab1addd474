"""Commands that are killed at random moments and go on end with the files of those that were left alone.

    python -m pytest -m slow tests/stress/test_kills.py
"""

import json
import random
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections import Counter

import numpy as np
import psutil
import pytest
from stress.others_results import without_measured

SEED = 20261127
KILLS = {"plan": 15, "train": 21, "follow": 12, "compare": 12, "study": 12}
SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
LEFTOVER = re.compile(r"\..+\.[0-9a-f]{8}(-journal)?|\.lock.*")
NOT_COMPARED = {"provenance.json", "comparison.db"}
SCRIPT = """
import random, time

def runs(sweep, seeds):
    return [{"name": f"walk-{number}", "seed": number} for number in range(60)]

def run(settings):
    draw = random.Random(settings["seed"])
    time.sleep(0.1 * draw.random())
    return {"seed": settings["seed"], "walk": [draw.random() for _ in range(5_000)]}
"""
ANALYSIS = """
from pbcs_ompl.experiments.claims import Claim

def analyse(records, figures):
    return [Claim("all came back", [one["seed"] for one in records] == list(range(60)))]
"""
MAZE = ["--env", "pbcs/Maze-v0", "--env-kwargs"]
COMMANDS = {
    "plan": ["plan", *MAZE, '{"size": 12, "maze_seed": 1}', "--planner", "RandomWalk", "--max-transitions", "6000"],
    "train": ["train", *MAZE, '{"size": 3, "maze_seed": 1}', "--seed", "1"],
    "follow": ["train", *MAZE, '{"size": 3, "maze_seed": 1}', "--method", "follow", "--seed", "1"],
    "compare": ["compare", "--planners", "Ex", "RRTNH", *MAZE, '{"size": 3}', "--seeds", "4", "--jobs", "2"],
    "study": ["study", "walks", "--jobs", "2"],
}


def start(words, folder):
    return subprocess.Popen([sys.executable, "-m", "pbcs_ompl.cli", *words], cwd=folder, stdout=subprocess.DEVNULL,
                            stderr=subprocess.PIPE, text=True)


def continued(verb, out):
    """Return the words that go on with what lies in a folder."""
    if verb in ("train", "follow") and (out / "config.toml").exists():
        return ["train", "--resume", out.name]
    return [*COMMANDS[verb], "--out", out.name]


def kill(verb, out, seconds, number):
    """Kill a command after some seconds; return whether it had ended before. Nothing is left behind half-written."""
    process = start(continued(verb, out), out.parent)
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(number)
        error = process.communicate(timeout=120)[1]
        assert process.returncode in (128 + number, -number, 0, 1), error
        assert "Traceback" not in error or process.returncode == -number, error  # before it could listen
        assert psutil.wait_procs(children, timeout=10)[1] == []
        check_whole(out)
        return process.returncode in (0, 1)
    error = process.stderr.read()
    finished = (out / "result.json").exists() and ("has ended" in error or "already exists" in error)
    assert process.returncode in (0, 1) or finished, error
    return True


def check_whole(out):
    for path in (path for path in out.rglob("*") if not LEFTOVER.fullmatch(path.name)):
        if path.suffix == ".json":
            json.loads(path.read_text("utf-8"))
        elif path.suffix == ".toml":
            tomllib.loads(path.read_text("utf-8"))
        elif path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as file:
                assert all(file[name] is not None for name in file.files)


def finish(verb, out):
    process = start(continued(verb, out), out.parent)
    error = process.communicate(timeout=600)[1]
    assert process.returncode in (0, 1), error


def contents(out):
    """Return what a folder holds, without what is measured."""
    found = {}
    for path in sorted(path for path in out.rglob("*") if path.is_file() and path.name not in NOT_COMPARED):
        name = str(path.relative_to(out))
        if path.suffix == ".json":
            found[name] = without_measured(json.loads(path.read_text("utf-8")))
        else:
            found[name] = path.read_bytes() if path.suffix in (".npz", ".safetensors", ".toml") else None
    return found


def killed_folders(verb, folder, moments):
    """Kill the command until its share of kills is used up; return the folders, all of them finished, and the kills."""
    began = time.monotonic()
    finish(verb, folder / "alone")
    took, kills, folders = time.monotonic() - began, Counter(), []
    while kills.total() < KILLS[verb]:
        folders.append(folder / f"killed-{len(folders)}")
        for _ in range(3):
            number = moments.choice(SIGNALS)
            ended = kill(verb, folders[-1], moments.uniform(0.2, took), number)
            kills[number.name] += not ended
            if ended:
                break
        finish_or_picture(verb, folders[-1])
    return folders, kills


def finish_or_picture(verb, out):
    picture = {"plan": "tree.png", "train": "chain.png", "follow": "chain.png"}.get(verb)
    if not (out / "result.json").exists() or (picture and not (out / picture).exists()) or verb in ("compare", "study"):
        finish(verb, out)


def prepare(verb, folder):
    """Write what the command needs beside its words."""
    if verb == "study":
        study = folder / "walks"
        study.mkdir()
        for name, text in (("study.py", SCRIPT), ("analysis.py", ANALYSIS),
                           ("sweep.toml", 'title = "Walks"\nseeds = 1\n')):
            (study / name).write_text(text, "utf-8")


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("verb", KILLS)
def test_what_was_killed_ends_as_if_it_had_not_been(tmp_path, verb):
    prepare(verb, tmp_path)
    folders, kills = killed_folders(verb, tmp_path, random.Random(f"{SEED} {verb}"))
    print(verb, dict(kills), f"{len(folders)} folders")
    alone = contents(tmp_path / "alone")
    for folder in folders:
        assert contents(folder) == alone, folder
    assert not [path for path in tmp_path.rglob(".*") if LEFTOVER.fullmatch(path.name)]
