"""The database is what OMPL's own converter would write, with more columns behind."""

import sqlite3

import pytest

from pbcs_ompl.compare.database import write_database
from pbcs_ompl.compare.run import Job, broken
from pbcs_ompl.core.errors import RunFolderError

CONFIG = {"env": "pbcs/Maze-v0", "planners": ["Ex", "RRT"], "seeds": [0, 1], "max_transitions": 100,
          "max_seconds": None, "planner_kwargs": {"Ex": {"bin_size": 0.1}}, "versions": {"ompl": "2.0.1"}}
EXPERIMENTS = ["id", "name", "totaltime", "timelimit", "memorylimit", "runcount", "version", "hostname",
               "cpuinfo", "date", "seed", "setup"]


def solved(planner, seed):
    return {"planner": planner, "seed": seed, "solved": True, "transitions": 50, "seconds": 0.5, "nodes": 20,
            "path_length": 7, "replay_ok": True, "memory": 100.0, "reason": None}


@pytest.fixture
def database(tmp_path):
    job = Job("RRT", 1, "pbcs/Maze-v0", {}, {}, 100, None)
    records = [solved("Ex", 0), solved("Ex", 1), solved("RRT", 0), broken(job, "died")]
    write_database(tmp_path / "c.db", CONFIG, records)
    write_database(tmp_path / "c.db", CONFIG, records)
    connection = sqlite3.connect(tmp_path / "c.db")
    yield connection
    connection.close()
    assert [path.name for path in tmp_path.iterdir()] == ["c.db"]


def columns(database, table):
    return [row[1] for row in database.execute(f"PRAGMA table_info({table})")]


def test_columns_planner_arena_relies_on(database):
    assert columns(database, "experiments")[:12] == EXPERIMENTS
    assert columns(database, "runs")[:3] == ["id", "experimentid", "plannerid"]
    assert columns(database, "progress")[:2] == ["runid", "time"]
    assert columns(database, "plannerConfigs") == ["id", "name", "settings"]
    assert columns(database, "enums") == ["name", "value", "description"]


def test_runs_belong_to_their_planner(database):
    query = ("SELECT p.name, r.seed, r.solved, r.transitions, e.description FROM runs r "
             "JOIN plannerConfigs p ON p.id = r.plannerid JOIN experiments x ON x.id = r.experimentid "
             "JOIN enums e ON e.name = 'status' AND e.value = r.status ORDER BY r.id")
    assert database.execute(query).fetchall() == [
        ("Ex", 0, 1, 50, "Exact solution"), ("Ex", 1, 1, 50, "Exact solution"),
        ("RRT", 0, 1, 50, "Exact solution"), ("RRT", 1, 0, None, "Crash")]
    assert database.execute("SELECT version, runcount, totaltime FROM experiments").fetchall() == \
        [("OMPL 2.0.1", 2, 1.5)]
    settings = database.execute("SELECT settings FROM plannerConfigs").fetchall()
    assert settings == [('{"bin_size": 0.1}',), ("{}",)]


def test_ompls_own_views_work(database, tmp_path):
    from ompl._benchmark_statistics import computeViews

    database.close()
    computeViews(str(tmp_path / "c.db"), False)
    with sqlite3.connect(tmp_path / "c.db") as again:
        best = again.execute("SELECT * FROM bestPlannerConfigsPerExperiment").fetchall()
    assert len(best) == 2


def test_folder_that_cannot_be_written(tmp_path):
    with pytest.raises(RunFolderError, match="cannot write"):
        write_database(tmp_path / "nowhere" / "c.db", CONFIG, [])
