"""Shards, a Makefile and a Slurm array make each run of a study exactly once, and leave the analysis to the last."""

import json
import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.run import Shard
from pbcs_ompl.experiments.run_study import run_shard, run_study
from pbcs_ompl.experiments.study import find_study
from pbcs_ompl.experiments.workers.schedulers import LARGEST_ARRAY, slurm_script

SCRIPT = '''
from pathlib import Path

def runs(sweep, seeds):
    return [{"name": f"it's ${seed}: 50 %", "seed": seed} for seed in range(seeds)]

def run(settings):
    with open(Path(__file__).parent / "log", "a") as log:
        log.write(f"{settings['seed']} ")
    return {"square": settings["seed"] ** 2}
'''
ANALYSIS = '''
from pbcs_ompl.experiments.claims import Claim

def analyse(records, figures):
    return [Claim("they are squares", [one["square"] for one in records] == [n * n for n in range(len(records))])]
'''


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "the squares"
    folder.mkdir()
    (folder / "study.py").write_text(SCRIPT)
    (folder / "analysis.py").write_text(ANALYSIS)
    (folder / "sweep.toml").write_text('title = "Squares"\nseeds = 2\n')
    return folder


@pytest.fixture
def study(folder, tmp_path, capsys):
    """Run `pbcs study` on the folder; return the status, and the JSON object or what was said."""

    def run(options):
        status = main(["study", str(folder), "--out", str(tmp_path / "out"), *shlex.split(options), "--json"])
        shown = capsys.readouterr()
        return status, json.loads(shown.out) if shown.out else shown.err

    return run


def made(folder):
    """Return the seeds of the runs that were made, each as often as it was."""
    log = folder / "log"
    return sorted(int(seed) for seed in log.read_text().split()) if log.exists() else []


@given(st.lists(st.integers()), st.integers(1, 20))
def test_shards_are_a_partition(runs, count):
    parts = [Shard(index, count).of(runs) for index in range(1, count + 1)]
    assert sorted(run for part in parts for run in part) == sorted(runs)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize(("index", "count"), [(0, 3), (4, 3), (1, 0)])
def test_a_shard_that_does_not_exist_is_named(index, count):
    with pytest.raises(InvalidOption, match=f"shard {index}/{count} does not exist"):
        Shard(index, count)


def test_the_union_of_the_shards_is_the_whole(folder, study, tmp_path):
    assert study("--seeds 5 --shard 2/2") == (0, {"id": "the squares", "shard": "2/2", "runs": 2, "failed": {},
                                                  "out": str(tmp_path / "out")})
    assert made(folder) == [1, 3]
    assert not (tmp_path / "out/result.json").exists()
    assert study("--seeds 5 --shard 1/2")[1]["runs"] == 3
    assert made(folder) == [0, 1, 2, 3, 4]
    status, result = study("--seeds 5")
    assert (status, result["runs"], result["agrees"][0]["agrees"]) == (0, 5, True)
    assert made(folder) == [0, 1, 2, 3, 4]
    assert not list((tmp_path / "out").glob(".lock*"))


def test_shards_begin_in_one_new_folder_at_the_same_time(folder, tmp_path):
    found = find_study(str(folder))
    shards = [Shard(index, 3) for index in range(1, 4)]
    with ThreadPoolExecutor(3) as pool:
        parts = list(pool.map(lambda shard: run_shard(found, shard, out=tmp_path / "out", seeds=3), shards))
    assert [list(part.records.values()) for part in parts] == [[{"square": n * n}] for n in range(3)]
    assert run_study(found, out=tmp_path / "out", seeds=3).agrees[0].agrees
    assert made(folder) == [0, 1, 2]


@pytest.mark.parametrize(("options", "message"), [
    ("--shard 3/2", "shard 3/2 does not exist; expected i/n with i from 1 to n"),
    ("--shard 2", "expected a part such as 2/3, got '2'"),
    ("--shard 1/2 --emit make", "leave out --emit"),
    ("--emit slrum", "unknown scheduler 'slrum'; did you mean 'slurm'?"),
    ("--executor rya", "unknown executor 'rya'; did you mean 'ray'?"),
    ("--address here:1", "add --executor ray"),
    ("--max-memory 0", "--max-memory"),
])
def test_mistakes_are_named(study, options, message):
    status, said = study(options)
    assert status == 2
    assert message in said


@pytest.mark.parametrize("words", [["study", "exploration-trees"],
                                   ["compare", "--planners", "Ex", "--env", "pbcs/Maze-v0"]])
def test_ray_asked_for_and_absent(words, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main([*words, "--executor", "ray", "--out", str(tmp_path / "out")]) == 3
    assert "pip install 'pbcs-ompl[ray]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_shard_without_a_common_folder_is_refused(folder, capsys):
    assert main(["study", str(folder), "--shard", "1/2"]) == 2
    assert "add --out" in capsys.readouterr().err


def test_limits_of_a_run_come_from_outside(folder, study):
    (folder / "study.py").write_text(SCRIPT.replace("    with open", "    __import__('time').sleep(9)\n    with open"))
    status, said = study("--seeds 1 --max-seconds 0.5")
    assert status == 2
    assert "killed after 0.5 s" in said


@pytest.mark.slow
def test_the_makefile_makes_each_run_once_and_then_the_analysis(folder, study, tmp_path):
    status, answer = study("--emit make --max-seconds 60")
    assert (status, answer["runs"], answer["file"]) == (0, 2, str(tmp_path / "out/Makefile"))
    assert made(folder) == []
    study("--shard 2/2")
    assert made(folder) == [1]
    subprocess.run(["make", "-C", tmp_path / "out", "--jobs", "2"], check=True, capture_output=True, timeout=100)
    assert made(folder) == [0, 1]
    assert json.loads((tmp_path / "out/result.json").read_text())["agrees"][0]["agrees"]


@pytest.mark.slow
def test_the_slurm_script_is_bash_and_its_tasks_make_each_run_once(folder, study, tmp_path):
    status, answer = study("--emit slurm")
    assert status == 0
    script = tmp_path / "out/slurm.sh"
    assert answer["file"] == str(script)
    subprocess.run(["bash", "-n", script], check=True)
    assert tasks_of(script.read_text()) == [1, 2]
    for task in tasks_of(script.read_text()):
        subprocess.run(["bash", script], check=True, capture_output=True, timeout=100,
                       env={**os.environ, "SLURM_ARRAY_TASK_ID": str(task)})
    assert made(folder) == [0, 1]


@given(st.integers(1, 3 * LARGEST_ARRAY))
def test_the_tasks_of_an_array_cover_every_run_however_many(runs):
    tasks = tasks_of(slurm_script(["pbcs", "study"], runs, "name", "/out"))
    assert len(tasks) <= LARGEST_ARRAY
    assert sorted(run for task in tasks for run in Shard(task, len(tasks)).of(range(runs))) == list(range(runs))


def tasks_of(script):
    line = next(line for line in script.splitlines() if line.startswith("#SBATCH --array="))
    first, last = line.partition("=")[2].split("-")
    return list(range(int(first), int(last) + 1))
