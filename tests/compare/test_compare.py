"""Laws of comparisons: every run is recorded, none disturbs another, what was done is not done again."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time

import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.compare import compare as module
from pbcs_ompl.compare.compare import compare
from pbcs_ompl.core.errors import InvalidOption, PbcsError, RunFolderError, UnknownName

MAZE = "pbcs/Maze-v0"
RRT, KPIECE1 = "ompl.control:RRT", "ompl.control:KPIECE1"
ROW = ["planner", "solved", "runs", "wilson", "transitions_median", "transitions_quartiles", "seconds_median",
       "reason"]


@pytest.fixture
def misbehaving(request, monkeypatch):
    """Let this and spawned processes import the module next to this file."""
    folder = str(request.path.parent)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([folder, os.environ.get("PYTHONPATH", "")]))


def test_warm_workers_give_the_results_of_a_fresh_process(tmp_path):
    comparison = compare([RRT, KPIECE1], MAZE, env_kwargs={"size": 3}, seeds=[3, 1], out=tmp_path / "out")
    for record in comparison.runs:
        alone = plan(MAZE, record["planner"], env_kwargs={"size": 3}, seed=record["seed"])
        mine = {key: record[key] for key in ("solved", "transitions", "nodes", "path_length", "replay_ok")}
        assert mine == {key: alone.summary()[key] for key in mine}
    order = [(record["planner"], record["seed"]) for record in comparison.runs]
    assert order == [(RRT, 3), (RRT, 1), (KPIECE1, 3), (KPIECE1, 1)]
    assert [list(row) for row in comparison.rows] == [ROW, ROW]
    assert json.loads((tmp_path / "out" / "result.json").read_text()) == comparison.summary()
    assert comparison.summary()["database"] == str(tmp_path / "out" / "comparison.db")


def test_failing_planners_are_recorded_and_the_others_go_on(misbehaving, tmp_path):
    names = ["misbehaving:Deadly", RRT, "misbehaving:Broken", "SST"]
    comparison = compare(names, MAZE, env_kwargs={"size": 2}, seeds=1, jobs=2, out=tmp_path / "out")
    deadly, rrt, broken, sst = comparison.rows
    assert [row["solved"] for row in comparison.rows] == [0, 1, 0, 0]
    assert rrt["reason"] is None
    assert "the process died" in deadly["reason"]
    assert "RuntimeError: this planner is broken" in broken["reason"]
    assert "cannot build SST" in sst["reason"]
    assert deadly["transitions_median"] is None
    records = [json.loads(path.read_text()) for path in sorted((tmp_path / "out" / "runs").iterdir())]
    assert len(records) == 4
    with sqlite3.connect(tmp_path / "out" / "comparison.db") as database:
        assert database.execute("SELECT count(*) FROM runs WHERE status = 7").fetchone() == (3,)


def test_planner_that_cannot_be_loaded_is_recorded_without_a_process(monkeypatch):
    from pbcs_ompl.core.errors import PlannerUnavailable

    def unavailable(name, options):
        raise PlannerUnavailable(f"{name} has no constructor")

    monkeypatch.setattr(module, "PlannerSpec", unavailable)
    comparison = compare(["SST"], MAZE, seeds=3)
    assert comparison.rows[0]["reason"] == "SST has no constructor"
    assert (comparison.rows[0]["solved"], comparison.rows[0]["runs"]) == (0, 3)
    assert comparison.summary()["database"] is None


def test_killed_comparison_resumes(misbehaving, tmp_path):
    """A process is killed in its second run; the same call makes only what is missing."""
    out, told = tmp_path / "out", tmp_path / "told"
    settings = {"planners": [RRT, "misbehaving:Waiting"], "env": MAZE, "env_kwargs": {"size": 2}, "seeds": 1,
                "planner_kwargs": {"misbehaving:Waiting": {"told": str(told)}}, "max_seconds": 3.0,
                "out": str(out)}
    program = ("import json, sys\nfrom pbcs_ompl.compare.compare import compare\n"
               "if __name__ == '__main__':\n    compare(**json.loads(sys.argv[1]))\n")
    (tmp_path / "main.py").write_text(program)
    process = subprocess.Popen([sys.executable, str(tmp_path / "main.py"), json.dumps(settings)])
    wait_until(lambda: told.exists() and told.read_text())
    process.kill()
    process.wait()
    wait_until(lambda: not alive(int(told.read_text())))
    assert [path.name for path in (out / "runs").iterdir()] == ["ompl.control.RRT-0.json"]
    with pytest.raises(RunFolderError, match="max_seconds"):
        compare(**{**settings, "max_seconds": 1.0})
    before = (out / "runs" / "ompl.control.RRT-0.json").stat().st_mtime_ns
    told_progress = []
    comparison = compare(**settings, on_progress=told_progress.append)
    assert (out / "runs" / "ompl.control.RRT-0.json").stat().st_mtime_ns == before
    assert told_progress == [{"runs": 1, "solved": 1}, {"runs": 2, "solved": 1}]
    assert [row["solved"] for row in comparison.rows] == [1, 0]
    assert comparison.runs[1]["reason"] == "the budget ended before the goal was reached"


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
    told = tmp_path / "told"
    program = ("import sys\nfrom pbcs_ompl.compare.compare import compare\nif __name__ == '__main__':\n"
               "    compare(['misbehaving:Waiting'], 'pbcs/Maze-v0', seeds=1, max_seconds=100.0,\n"
               "            planner_kwargs={'misbehaving:Waiting': {'told': sys.argv[1]}})\n")
    (tmp_path / "main.py").write_text(program)
    process = subprocess.Popen([sys.executable, str(tmp_path / "main.py"), str(told)], stderr=subprocess.PIPE)
    wait_until(lambda: told.exists() and told.read_text())
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode != 0
    assert b"KeyboardInterrupt" in errors
    wait_until(lambda: not alive(int(told.read_text())))


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"planners": ["KPEICE1"]}, UnknownName, "did you mean 'KPIECE1'"),
    ({"planners": []}, InvalidOption, "0 planners"),
    ({"planners": [RRT, RRT]}, InvalidOption, "twice"),
    ({"seeds": 0}, InvalidOption, "0 seeds"),
    ({"seeds": [1, 1]}, InvalidOption, "twice"),
    ({"jobs": 0}, InvalidOption, "jobs is 0"),
    ({"max_transitions": 0}, InvalidOption, "max_transitions"),
    ({"env": "pbcs/Mase-v0"}, UnknownName, "did you mean"),
    ({"env_kwargs": {"size": 0}}, InvalidOption, "size"),
    ({"planner_kwargs": {"Ex": {}}}, InvalidOption, "not compared"),
    ({"planner_kwargs": {RRT: {"goal_bias": 1}}}, InvalidOption, "takes no options"),
])
def test_mistakes_are_named_before_anything_runs(tmp_path, arguments, error, message):
    with pytest.raises(error, match=message):
        compare(**{"planners": [RRT], "env": MAZE, "out": tmp_path / "out", **arguments})
    assert not (tmp_path / "out" / "runs").exists()


def test_foreign_folder_is_refused(tmp_path):
    (tmp_path / "precious.txt").write_text("keep me")
    with pytest.raises(PbcsError, match="already exists"):
        compare([RRT], MAZE, out=tmp_path)
