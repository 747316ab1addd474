"""A study that is killed again and again, at any moment, ends with the records of one that was left alone."""

import json
import random
import signal
import subprocess
import sys
import time

import psutil
import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.experiments.run_study import open_study, run_study
from pbcs_ompl.experiments.study import find_study

RUNS, KILLS = 120, 8
SCRIPT = f'''
import random, time
from pathlib import Path

def runs(sweep, seeds):
    return [{{"name": f"walk-{{number}}", "seed": number}} for number in range({RUNS})]

def run(settings):
    with open(Path(__file__).parent / "log", "a") as log:
        log.write(f"walk-{{settings['seed']}}\\n")
    draw = random.Random(settings["seed"])
    time.sleep(0.3 * draw.random())
    return {{"seed": settings["seed"], "walk": [draw.random() for _ in range(20_000)]}}
'''
ANALYSIS = '''
from pbcs_ompl.experiments.claims import Claim

def analyse(records, figures):
    return [Claim("all came back", [one["seed"] for one in records] == list(range(len(records))))]
'''


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "walks"
    folder.mkdir()
    (folder / "study.py").write_text(SCRIPT)
    (folder / "analysis.py").write_text(ANALYSIS)
    (folder / "sweep.toml").write_text('title = "Walks"\nseeds = 1\n')
    return folder


def records_of(out):
    """Read all records; none may be half-written."""
    return {path.name: json.loads(path.read_text()) for path in out.glob("runs/*.json")}


@pytest.mark.slow
def test_killed_at_random_moments_it_ends_with_the_same_records(folder, tmp_path):
    out, moments = tmp_path / "out", random.Random(1)
    command = [sys.executable, "-m", "pbcs_ompl.cli", "study", str(folder), "--jobs", "2", "--out", str(out)]
    kept, interrupted = {}, 0
    for kill in range(KILLS):
        (folder / "log").write_text("")
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        while kill % 2 and process.poll() is None and len(list(out.glob("runs/*.json"))) <= len(kept):
            time.sleep(0.02)  # half of the kills come amid the runs, whatever the machine has to do
        time.sleep(moments.uniform(0.0, 1.0 if kill % 2 else 2.0))
        workers = psutil.Process(process.pid).children() if process.poll() is None else []
        process.kill()
        interrupted += process.wait() == -signal.SIGKILL
        assert psutil.wait_procs(workers, timeout=20)[1] == []
        begun, records = (folder / "log").read_text().split(), records_of(out)
        assert len(begun) == len(set(begun))
        assert not {f"{name}.json" for name in begun} & kept.keys()  # none that was finished is made again
        assert kept == {name: records[name] for name in kept}  # none is lost
        kept = records
    assert interrupted >= 5
    assert subprocess.run(command, stdout=subprocess.DEVNULL).returncode == 0
    (folder / "log").unlink()
    undisturbed = run_study(find_study(str(folder)), out=tmp_path / "undisturbed", jobs=2)
    assert undisturbed.agrees[0].agrees
    assert records_of(out) == records_of(tmp_path / "undisturbed")
    assert len(records_of(out)) == RUNS


def test_a_second_process_is_kept_out_of_the_folder(folder, tmp_path, capsys):
    study = find_study(str(folder))
    with open_study(study, tmp_path / "out"):
        with pytest.raises(RunFolderError, match="is in use by another process"):
            run_study(study, out=tmp_path / "out")
        assert main(["study", str(folder), "--out", str(tmp_path / "out")]) == 2
        assert main(["study", str(folder), "--out", str(tmp_path / "out"), "--shard", "1/2"]) == 2
    assert capsys.readouterr().err.count("is in use by another process; wait until it ends") == 2


@pytest.mark.parametrize("damage", ['{"seed": 0, "wa', "", "[1]", "null"])
def test_a_damaged_record_is_named_with_the_remedy(folder, tmp_path, damage):
    study = find_study(str(folder))
    open_study(study, tmp_path / "out").close()
    (tmp_path / "out/runs").mkdir()
    (tmp_path / "out/runs/walk-1.json").write_text(damage)
    with pytest.raises(DamagedFile, match=r"walk-1\.json is damaged: .*; remove the file to have this run made again"):
        run_study(study, out=tmp_path / "out")
    assert not (folder / "log").exists()
