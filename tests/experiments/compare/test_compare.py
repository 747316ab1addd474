"""Laws of comparisons: every run is recorded, none disturbs another, none is made twice."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time

import gymnasium
import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import (
    DamagedFile,
    InvalidOption,
    PbcsError,
    RunFolderError,
    UnknownName,
)
from pbcs_ompl.experiments import compare as comparison
from pbcs_ompl.experiments.compare import compare, read_comparison
from pbcs_ompl.experiments.sweep import Sweep, environment_specs, make_sweep
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import read_toml, write_toml
from pbcs_ompl.results.folder import open_run

MAZE = "pbcs/Maze-v0"
RRT, KPIECE1 = "ompl.control:RRT", "ompl.control:KPIECE1"
ROW = ["environment", "planner", "solved", "runs", "failed", "wilson", "transitions_median", "transitions_quartiles",
       "seconds_median", "collision_checks_median", "path_length_median", "coverage_median", "reason"]
SAME = ("solved", "transitions", "collision_checks", "nodes", "path_length", "replay_ok")


def test_warm_workers_give_the_results_of_a_fresh_process(tmp_path):
    """In two environments with two seeds; what is read from the folder is what was returned."""
    found = compare([RRT, KPIECE1], MAZE, env_kwargs=[{"size": 2}, {"size": 3}], seeds=[3, 1], out=tmp_path / "out")
    for record in found.runs:
        alone = plan(EnvSpec.from_dict(record["environment"]), record["planner"], seed=record["seed"], coverage=True)
        assert {key: record[key] for key in SAME} == {key: alone.summary()[key] for key in SAME}
        assert record["progress"]["coverage"] == alone.coverage.share.tolist()
        assert record["coverage"] == alone.coverage.share[-1]
    order = [(record["environment"]["kwargs"]["size"], record["planner"], record["seed"]) for record in found.runs]
    assert order == [(size, planner, seed) for size in (2, 3) for planner in (RRT, KPIECE1) for seed in (3, 1)]
    assert [list(row) for row in found.rows] == [ROW] * 4
    assert [row["environment"] for row in found.rows] == [f"{MAZE}(size={size})" for size in (2, 2, 3, 3)]
    assert [test["planners"] for test in found.tests] == [[RRT, KPIECE1]] * 2
    assert found.database == str(tmp_path / "out/comparison.db")
    assert json.loads((tmp_path / "out/result.json").read_text()) == found.summary()
    again = read_comparison(tmp_path / "out")
    assert (again.summary(), again.runs) == (found.summary(), found.runs)



def test_plans_are_made_shorter_as_in_plan(tmp_path):
    found = compare(["Ex"], MAZE, env_kwargs={"size": 3}, seeds=1, improve="50%", out=tmp_path / "out")
    alone = plan(MAZE, "Ex", env_kwargs={"size": 3}, seed=0, improve="50%")
    (record,) = found.runs
    assert alone.improvement is not None
    assert record["path_length"] == record["improvement"]["after"] == alone.improvement.after
    assert record["improvement"]["before"] == alone.improvement.before > alone.improvement.after
    assert record["transitions"] == alone.transitions
    assert read_comparison(tmp_path / "out").runs == found.runs
    assert read_toml(tmp_path / "out/config.toml")["improve"] == "50%"
    with pytest.raises(RunFolderError):
        compare(["Ex"], MAZE, env_kwargs={"size": 3}, seeds=1, out=tmp_path / "out")


def test_every_run_of_a_planner_that_misbehaves_is_recorded_and_the_others_continue(misbehaving, tmp_path):
    """One that dies, raises, cannot be built, or uses too much memory; no limit of time is set."""
    reasons = {"misbehaving:Deadly": "the process died", "misbehaving:Broken": "RuntimeError: this planner is broken",
               "SST": "cannot build SST", "misbehaving:Hungry": "the limit of one run is 700"}
    found = compare([*reasons, RRT], MAZE, env_kwargs={"size": 2}, seeds=1, jobs=2, max_memory=700.0,
                    out=tmp_path / "out")
    assert [(row["solved"], row["failed"]) for row in found.rows] == [*[(0, 1)] * 4, (1, 0)]
    for row in found.rows[:4]:
        assert reasons[row["planner"]] in row["reason"]
        assert "\n" not in row["reason"]
        assert row["transitions_median"] is None
    assert found.rows[4]["reason"] is None
    assert found.tests == []
    assert len(list((tmp_path / "out/runs/1-Maze-v0").glob("*.json"))) == 5
    with sqlite3.connect(tmp_path / "out/comparison.db") as database:
        assert database.execute("SELECT count(*) FROM runs WHERE status = 7").fetchone() == (4,)


def test_a_planner_that_hangs_so_that_python_stands_still_is_killed(misbehaving, monkeypatch):
    monkeypatch.setattr(comparison, "SECONDS_OF_GRACE", 0.5)
    found = compare(["misbehaving:Hanging"], MAZE, env_kwargs={"size": 2}, seeds=1, max_seconds=0.5)
    assert found.rows[0]["reason"] == "killed after 1 s, the limit of one run"
    assert found.summary()["database"] is None


def test_killed_comparison_resumes(misbehaving, tmp_path):
    """A process is killed in its second run; the same call makes only what is missing."""
    out, note = tmp_path / "out", tmp_path / "note"
    settings = {"planners": {RRT: {}, "misbehaving:Waiting": {"file": str(note)}}, "env": MAZE,
                "env_kwargs": {"size": 2}, "seeds": 1, "max_seconds": 3.0, "out": str(out)}
    program = ("import json, sys\nfrom pbcs_ompl.experiments.compare import compare\n"
               "if __name__ == '__main__':\n    compare(**json.loads(sys.argv[1]))\n")
    (tmp_path / "main.py").write_text(program)
    process = subprocess.Popen([sys.executable, str(tmp_path / "main.py"), json.dumps(settings)])
    record = out / "runs/1-Maze-v0/ompl.control.RRT-0.json"
    wait_until(lambda: note.exists() and note.read_text() and record.exists())
    process.kill()
    process.wait()
    wait_until(lambda: not alive(int(note.read_text())))
    assert list(record.parent.glob("*.json")) == [record]
    assert len(read_comparison(out).runs) == 1
    with pytest.raises(RunFolderError, match="max_seconds"):
        compare(**{**settings, "max_seconds": 1.0})
    before = record.stat().st_mtime_ns
    reports = []
    found = compare(**settings, on_progress=reports.append)
    assert record.stat().st_mtime_ns == before
    assert [(numbers["runs"], numbers["solved"]) for numbers in reports] == [(1, 1), (2, 1)]
    assert [(row["planner"], row["runs"], row["solved"]) for row in reports[0]["table"]] == \
        [(RRT, "1/1", 1), ("misbehaving:Waiting", "0/1", 0)]
    assert [row["solved"] for row in found.rows] == [1, 0]
    assert found.runs[1]["reason"] == "the budget ended before the goal was reached"


def wait_until(condition, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{pid}/stat") as file:
        return file.read().rpartition(")")[2].split()[0] != "Z"


def test_control_c_stops_the_processes(misbehaving, tmp_path):
    note = tmp_path / "note"
    program = ("import sys\nfrom pbcs_ompl.experiments.compare import compare\nif __name__ == '__main__':\n"
               "    compare({'misbehaving:Waiting': {'file': sys.argv[1]}}, 'pbcs/Maze-v0', max_seconds=100.0)\n")
    (tmp_path / "main.py").write_text(program)
    process = subprocess.Popen([sys.executable, str(tmp_path / "main.py"), str(note)], stderr=subprocess.PIPE)
    wait_until(lambda: note.exists() and note.read_text())
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode != 0
    assert b"KeyboardInterrupt" in errors
    wait_until(lambda: not alive(int(note.read_text())))


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"planners": ["KPEICE1"]}, UnknownName, "did you mean 'KPIECE1'"),
    ({"planners": []}, InvalidOption, "no planners"),
    ({"env_kwargs": []}, InvalidOption, "no environments"),
    ({"env_kwargs": [{}, {}]}, InvalidOption, "twice"),
    ({"env": [MAZE] * 3, "env_kwargs": [{"size": 2}] * 2}, InvalidOption, "3 environments and 2 sets of options"),
    ({"max_memory": 0.0}, InvalidOption, "max_memory is 0.0; expected more than 0"),
    ({"env": EnvSpec(MAZE), "env_kwargs": {"size": 2}}, InvalidOption, "has its options already"),
    ({"env": EnvSpec("pbcs/Mase-v0")}, UnknownName, "did you mean"),
    ({"planners": [RRT, RRT]}, InvalidOption, "twice"),
    ({"seeds": 0}, InvalidOption, "seeds is 0"),
    ({"seeds": [1, 1]}, InvalidOption, "twice"),
    ({"jobs": 0}, InvalidOption, "jobs is 0"),
    ({"max_transitions": 0}, InvalidOption, "max_transitions"),
    ({"env": "pbcs/Mase-v0"}, UnknownName, "did you mean"),
    ({"env_kwargs": {"size": 0}}, InvalidOption, "size"),
    ({"planners": {RRT: {"goal_bias": 1}}}, InvalidOption, "takes no options"),
])
def test_mistakes_are_named_before_anything_runs(tmp_path, arguments, error, message):
    with pytest.raises(error, match=message):
        compare(**{"planners": [RRT], "env": MAZE, "out": tmp_path / "out", **arguments})
    assert not (tmp_path / "out" / "runs").exists()


def test_a_folder_with_other_files_is_refused(tmp_path):
    (tmp_path / "precious.txt").write_text("keep me")
    with pytest.raises(PbcsError, match="already exists"):
        compare([RRT], MAZE, out=tmp_path)


def test_a_damaged_record_is_named_and_everything_is_left_as_it_is(tmp_path):
    out = tmp_path / "out"
    compare(["SST"], MAZE, seeds=2, out=out)
    record = out / "runs/1-Maze-v0/SST-1.json"
    for damage in ("", "{", "[]", '{"name": "1-Maze-v0/another-0"}'):
        record.write_text(damage)
        for again in (lambda: compare(["SST"], MAZE, seeds=2, out=out), lambda: read_comparison(out)):
            with pytest.raises(DamagedFile, match=r"SST-1\.json.*remove the file"):
                again()
        assert record.read_text() == damage
    record.unlink()
    assert compare(["SST"], MAZE, seeds=3, out=out).rows[0]["runs"] == 3


def test_a_folder_in_use_by_another_process_is_refused(tmp_path):
    with open_run(tmp_path / "out", make_sweep(["SST"], [EnvSpec(MAZE)], 1, 100, None, None).config()), \
            pytest.raises(RunFolderError, match="in use"):
        compare(["SST"], MAZE, seeds=1, max_transitions=100, out=tmp_path / "out")


def test_the_resolved_options_of_the_planners_are_in_the_config(tmp_path):
    found = compare({"Ex": {"batch": 1}, RRT: {}}, MAZE, env_kwargs={"size": 2}, seeds=1, out=tmp_path / "out")
    options = read_toml(tmp_path / "out/config.toml")["planner_kwargs"]
    assert options == {"Ex": {"batch": 1, "control_duration": 1}, RRT: {}}
    assert found.runs[0]["planner_settings"] == {**options["Ex"], "bin_size": [0.15, 0.15]}
    assert compare({"Ex": {"batch": 1}, RRT: {}}, MAZE, env_kwargs={"size": 2}, seeds=1, out=tmp_path / "out").rows


@pytest.mark.parametrize("form", [
    lambda: EnvSpec(MAZE, {"size": 2}), lambda: gymnasium.make(MAZE, size=2), lambda: make(MAZE, {"size": 2})])
def test_an_environment_in_any_form_is_its_spec(form):
    assert environment_specs(form()) == [EnvSpec(MAZE, {"size": 2})]
    assert environment_specs([form(), MAZE], goal="reward>0") == [
        EnvSpec(MAZE, {"size": 2}, goal="reward>0"), EnvSpec(MAZE, goal="reward>0")]


def test_an_environment_that_other_processes_cannot_make_is_named():
    model = make(MAZE, {"size": 2})
    model.spec = EnvSpec("my-own-env")
    with pytest.raises(InvalidOption, match="my-own-env is not registered, so that other processes cannot make it"):
        compare(["Ex"], model)


def test_a_sweep_survives_its_config(tmp_path):
    environments = [EnvSpec(MAZE, {"size": 2}), EnvSpec(MAZE, {"size": 3}, goal="reward>0", start_seed=4)]
    sweep = make_sweep({"Ex": {"bin_size": 0.2}, "EST": {}}, environments, [4, 2], 100, 1.5, None)
    write_toml(tmp_path / "config.toml", sweep.config())
    assert Sweep.from_config(read_toml(tmp_path / "config.toml")) == sweep
    names = [run.name for run in sweep.runs()]
    assert len(set(names)) == len(names) == 8


def test_a_folder_of_something_else_is_no_comparison(tmp_path):
    plan(MAZE, RRT, env_kwargs={"size": 2}, max_transitions=10, out=tmp_path / "out")
    with pytest.raises(DamagedFile, match="has the kind 'plan'; expected compare"):
        read_comparison(tmp_path / "out")
    with pytest.raises(DamagedFile, match="does not exist"):
        read_comparison(tmp_path / "nowhere")
