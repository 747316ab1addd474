"""A study runs each run once, survives whatever happens to one of them, and is resumed where it was stopped."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, PbcsError, RunFolderError, UnknownName
from pbcs_ompl.experiments.claims import rate
from pbcs_ompl.experiments.run_study import run_study
from pbcs_ompl.experiments.shipped_records import PACKED, pack, runs_without_record, shipped_records
from pbcs_ompl.experiments.study import find_study, study_folders, study_ids

SWEEP = 'title = "Heads or tails"\nseeds = 3\nsides = 2\n'
SCRIPT = '''
import os, time
from pathlib import Path
from pbcs_ompl.core.errors import PbcsError

HERE = Path(__file__).parent

def runs(sweep, seeds):
    return [{"name": f"coin-{seed}", "seed": seed, "sides": sweep["sides"]} for seed in range(seeds)]

def run(settings):
    with open(HERE / "log", "a") as log:
        log.write(settings["name"] + "\\n")
    mischief = HERE / settings["name"]
    if mischief.exists():
        return {"die": lambda: os._exit(9), "raise": lambda: 1 / 0, "wait": lambda: time.sleep(60),
                "refuse": lambda: (_ for _ in ()).throw(PbcsError("no coin")),
                "strange": lambda: {"side": print}}[mischief.read_text()]()
    return {"side": settings["seed"] % settings["sides"]}
'''
ANALYSIS = '''
from pbcs_ompl.figures.canvas import new_figure, save
from pbcs_ompl.experiments.claims import Claim, rate

def analyse(records, figures):
    figure, axes = new_figure()
    axes.plot([record["side"] for record in records])
    save(figure, figures / "coins.png")
    heads = sum(record["side"] for record in records)
    return [Claim("some are heads", heads > 0, {"heads": rate(heads, len(records))}, "a coin"),
            Claim("none are tails", heads == len(records), note="half of them are")]
'''


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "coin-toss"
    folder.mkdir()
    (folder / "study.py").write_text(SCRIPT)
    (folder / "analysis.py").write_text(ANALYSIS)
    (folder / "sweep.toml").write_text(SWEEP)
    return folder


def log(folder):
    return sorted((folder / "log").read_text().split())


def test_each_run_is_made_once_and_the_claims_follow(folder, tmp_path):
    result = run_study(find_study(str(folder)), out=tmp_path / "out")
    assert [claim.agrees for claim in result.agrees] == [True, False]
    assert [record["side"] for record in result.records] == [0, 1, 0]
    assert result.agrees[0].numbers["heads"] == rate(1, 3)
    assert log(folder) == ["coin-0", "coin-1", "coin-2"]
    assert json.loads((tmp_path / "out/result.json").read_text()) == result.summary()
    assert result.figures == [str(tmp_path / "out/figures/coins.png")]
    again = run_study(find_study(str(folder)), out=tmp_path / "out", seeds=4, jobs=2)
    assert len(again.records) == 4
    assert log(folder) == ["coin-0", "coin-1", "coin-2", "coin-3"]


def test_a_run_that_dies_or_raises_costs_only_itself_and_is_tried_again(folder, tmp_path):
    for name, mischief in {"coin-0": "die", "coin-1": "raise", "coin-2": "refuse", "coin-3": "strange"}.items():
        (folder / name).write_text(mischief)
    result = run_study(find_study(str(folder)), out=tmp_path / "out", seeds=6)
    assert [record["side"] for record in result.records] == [0, 1]
    assert set(result.failed) == {"coin-0", "coin-1", "coin-2", "coin-3"}
    assert "process died" in result.failed["coin-0"]
    assert result.failed["coin-1"] == "ZeroDivisionError: division by zero"
    assert result.failed["coin-2"] == "no coin"
    assert result.failed["coin-3"] == "TypeError: cannot write builtin_function_or_method as JSON"
    for name in result.failed:
        (folder / name).unlink()
    again = run_study(find_study(str(folder)), out=tmp_path / "out", seeds=6)
    assert (len(again.records), again.failed) == (6, {})
    assert log(folder).count("coin-4") == 1


def test_a_killed_study_is_resumed(folder, tmp_path):
    (folder / "coin-2").write_text("wait")
    command = [sys.executable, "-m", "pbcs_ompl.cli", "study", str(folder), "--out", str(tmp_path / "out")]
    child = subprocess.Popen(command, start_new_session=True)
    while not (tmp_path / "out/runs/coin-1.json").is_file() or len(log(folder)) < 3:
        assert child.poll() is None
        time.sleep(0.05)
    os.killpg(child.pid, signal.SIGKILL)
    child.wait()
    (folder / "coin-2").unlink()
    result = run_study(find_study(str(folder)), out=tmp_path / "out")
    assert len(result.records) == 3
    assert log(folder) == ["coin-0", "coin-1", "coin-2", "coin-2"]


def test_mistakes_are_named(folder, tmp_path):
    study = find_study(str(folder))
    with pytest.raises(UnknownName, match="did you mean 'deadlock'"):
        find_study("deadlok")
    with pytest.raises(InvalidOption):
        run_study(study, out=tmp_path / "out", seeds=0)
    run_study(study, out=tmp_path / "out", seeds=1)
    (folder / "sweep.toml").write_text(SWEEP.replace("sides = 2", "sides = 3"))
    with pytest.raises(RunFolderError, match=r"another run \(sides\)"):
        run_study(find_study(str(folder)), out=tmp_path / "out")
    (tmp_path / "out/runs/coin-0.json").write_text("{")
    with pytest.raises(DamagedFile, match=r"coin-0\.json"):
        run_study(study, out=tmp_path / "out")
    (folder / "coin-0").write_text("raise")
    with pytest.raises(PbcsError, match="all runs of coin-toss failed; coin-0: ZeroDivisionError"):
        run_study(study, out=tmp_path / "other", seeds=1)


@pytest.mark.parametrize(("name", "text", "expected"), [
    ("sweep.toml", "title = 3 4", "is damaged"),
    ("sweep.toml", "seeds = 3", "lacks 'title'"),
    ("study.py", "def runs(sweep, seeds): ...", "lacks run"),
    ("analysis.py", "", "lacks analyse"),
    ("study.py", "import nowhere", "does not run: ModuleNotFoundError"),
])
def test_a_broken_study_is_one_clear_line(folder, name, text, expected):
    (folder / name).write_text(text)
    with pytest.raises(PbcsError, match=expected):
        find_study(str(folder)).all_runs()


@pytest.mark.parametrize(("settings", "expected"), [
    ('"name": "coin"', "names of their own"),
    ('"name": f"a/{seed}"', "names of their own"),
    ('"coin": seed', "names of their own"),
    ('"name": f"coin-{seed}", "toss": print', "must be plain values: cannot write builtin_function_or_method"),
])
def test_runs_need_names_and_plain_settings(folder, tmp_path, settings, expected):
    (folder / "study.py").write_text(SCRIPT.replace('"name": f"coin-{seed}"', settings))
    with pytest.raises(PbcsError, match=expected):
        run_study(find_study(str(folder)), out=tmp_path / "out")


def test_the_verb(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["study", str(folder), "--seeds", "2", "--json"]) == 0
    shown = capsys.readouterr()
    answer = json.loads(shown.out)
    assert {"id", "runs", "out", "figures", "agrees"} <= set(answer)
    assert (answer["id"], answer["runs"], answer["out"]) == ("coin-toss", 2, "runs/study-coin-toss-2")
    assert [claim["agrees"] for claim in answer["agrees"]] == [True, False]
    assert "DIFFERS   none are tails" in shown.err
    assert shown.err.count("\n") < 10, "a claim takes one line"
    (folder / "coin-0").write_text("raise")
    assert main(["study", str(folder), "--seeds", "2"]) == 1
    assert main(["study"]) == 2


def test_the_list_names_every_study_of_the_project(capsys):
    assert main(["study", "--list", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["studies"] == study_ids()
    assert "deadlock" in study_ids()


def test_shipped_records_all_or_a_part_make_the_same_figures_and_claims_without_any_run(folder, tmp_path, capsys):
    made = run_study(find_study(str(folder)), out=tmp_path / "made", seeds=5)
    assert pack(tmp_path / "made") == folder / "records.json.xz"
    (folder / "log").unlink()
    assert main(["study", str(folder), "--from-records", "--json", "--out", str(tmp_path / "again")]) == 0
    again = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert again | {"out": "", "figures": []} == made.summary() | {"out": "", "figures": []}
    assert (tmp_path / "again/figures/coins.png").read_bytes() == (tmp_path / "made/figures/coins.png").read_bytes()
    assert not (folder / "log").exists()
    run_study(find_study(str(folder)), out=tmp_path / "again", seeds=6)
    assert log(folder) == ["coin-5"]
    (tmp_path / "made/runs/coin-1.json").unlink()
    pack(tmp_path / "made")
    part = run_study(find_study(str(folder)), out=tmp_path / "part", from_records=True)
    assert (len(part.records), part.left_out) == (4, {"coin": 1})
    assert main(["study", str(folder), "--from-records", "--out", str(tmp_path / "part")]) == 0
    assert f"1 runs; pbcs study {folder} --out {tmp_path / 'part'} makes them" in capsys.readouterr().out


def test_missing_and_damaged_shipped_records_are_named(folder, tmp_path, capsys):
    study = find_study(str(folder))
    with pytest.raises(InvalidOption, match="comes without records"):
        run_study(study, out=tmp_path / "out", from_records=True)
    (folder / "records.json.xz").write_bytes(b"xz")
    with pytest.raises(DamagedFile, match=r"records\.json\.xz"):
        run_study(study, out=tmp_path / "out", from_records=True)
    assert main(["study", str(folder), "--from-records", "--seeds", "3"]) == 2
    assert "leave out" in capsys.readouterr().err


@pytest.mark.parametrize("name", [name for name, folder in study_folders().items() if (folder / PACKED).is_file()])
def test_the_shipped_records_are_those_of_the_present_runs(name):
    study = find_study(name)
    seeds, left_out, records = shipped_records(study)
    runs = study.all_runs(seeds)
    assert records
    assert set(records) <= {run.name for run in runs}
    assert left_out == runs_without_record(runs, records)


def test_figures_are_drawn_from_records_without_torch():
    code = ("import sys\n"
            "class Without:\n"
            "    def find_spec(self, name, *_):\n"
            "        if name in ('torch', 'safetensors'):\n"
            "            raise ModuleNotFoundError(name)\n"
            "sys.meta_path.insert(0, Without())\n"
            "from pbcs_ompl.experiments.study import find_study, study_ids\n"
            "print(*(study.id for study in map(find_study, study_ids()) if callable(study.analyse)))\n")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split() == list(study_ids()), done.stderr
