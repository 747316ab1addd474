"""The log is what OMPL's own reader takes, and the database it makes holds every number of the records."""

import json
import platform
import sqlite3
from pathlib import Path

import pytest
from ompl.tools import readBenchmarkLog

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import RunFolderError
from pbcs_ompl.experiments.planner_arena import write_database, write_logs
from pbcs_ompl.experiments.planning_run import failed_record
from pbcs_ompl.experiments.run import Failure
from pbcs_ompl.experiments.sweep import make_sweep

EXPERIMENTS = ["id", "name", "totaltime", "timelimit", "memorylimit", "runcount", "version", "hostname",
               "cpuinfo", "date", "seed", "setup"]
OURS = ["transitions", "collision_checks", "path_length", "replay_ok", "coverage", "seed"]


@pytest.fixture
def sweep():
    return make_sweep({"Ex": {"bin_size": [0.1, 0.2]}, "RRT": {}},
                      [EnvSpec("pbcs/Maze-v0", {"size": size}) for size in (2, 3)], [4, 5], 100, None, 500.0)


@pytest.fixture
def records(sweep):
    """Every run is solved but those of RRT: one fails, one is not solved."""
    made = []
    for number, run in enumerate(sweep.runs(), start=1):
        record = {**failed_record(run, Failure("")), "solved": True, "transitions": 50 + number,
                  "collision_checks": 60 + number, "seconds": 0.5 * number, "nodes": 20, "path_length": 7,
                  "replay_ok": True, "memory": 100.5,
                  "coverage": 0.25, "progress": {"transitions": [1, 50 + number], "seconds": [1e-7, 0.5 * number],
                                                 "coverage": [0.125, 0.25]}, "reason": None}
        unsolved = {**record, "solved": False, "path_length": None, "replay_ok": None}
        died = failed_record(run, Failure("died"))
        made.append(record if run.settings["planner"] == "Ex" else died if run.settings["seed"] == 4 else unsolved)
    return made


@pytest.fixture
def database(sweep, records, tmp_path):
    logs = write_logs(tmp_path, sweep, records)
    assert [log.name for log in logs] == ["comparison-1-Maze-v0.log", "comparison-2-Maze-v0.log"]
    for _ in range(2):
        write_database(tmp_path / "c.db", logs)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.db", *(log.name for log in logs)]
    connection = sqlite3.connect(tmp_path / "c.db")
    yield connection
    connection.close()


def columns(database, table):
    return [row[1] for row in database.execute(f"PRAGMA table_info({table})")]


def test_columns_planner_arena_relies_on(database):
    assert columns(database, "experiments") == [*EXPERIMENTS, "transition_limit"]
    assert columns(database, "runs")[:3] == ["id", "experimentid", "plannerid"]
    assert columns(database, "runs")[-6:] == OURS
    assert columns(database, "progress") == ["runid", "time", "transitions", "coverage", "best_cost"]


def test_every_number_of_every_record_is_in_the_database(database, records):
    names = ["time", "memory", "solved", *OURS, "correct_solution", "solution_length", "graph_states"]
    found = database.execute("SELECT x.name, p.name, e.description, " + ", ".join(f"r.{name}" for name in names) +
                             " FROM runs r JOIN plannerConfigs p ON p.id = r.plannerid "
                             "JOIN experiments x ON x.id = r.experimentid "
                             "JOIN enums e ON e.name = 'status' AND e.value = r.status").fetchall()
    fields = ["seconds", "memory", "solved", *OURS, "replay_ok", "path_length", "nodes"]
    expected = [(f"pbcs/Maze-v0(size={record['environment']['kwargs']['size']})", record["planner"],
                 "Exact solution" if record["solved"] else "Crash" if record["seconds"] is None else "Timeout",
                 *(record[name] for name in fields)) for record in records]
    assert sorted(found, key=str) == sorted(expected, key=str)


def test_progress_belongs_to_its_run(database, records):
    query = "SELECT r.transitions, g.time, g.transitions, g.coverage FROM progress g JOIN runs r ON r.id = g.runid"
    expected = [(record["transitions"], *sample) for record in records if record["progress"] is not None
                for sample in zip(*(record["progress"][name] for name in ("seconds", "transitions", "coverage")),
                                  strict=True)]
    assert sorted(database.execute(query).fetchall()) == sorted(expected)


def test_costs_of_solutions_are_shown_over_time(sweep, records, tmp_path):
    """The steps of the best plan so far, with those that were made after the search."""
    longer, never = records[0], [record for record in records if not record["solved"]]
    longer["improvement"] = {"before": 7, "after": 4, "transitions": 30, "seconds": 2.0, "progress": {
        "transitions": [0, 10, 20], "seconds": [0.0, 0.25, 1.0], "length": [7, 6, 4]}}
    write_database(tmp_path / "c.db", write_logs(tmp_path, sweep, records))
    query = ("SELECT r.transitions, g.time, g.transitions, g.coverage, g.best_cost FROM progress g "
             "JOIN runs r ON r.id = g.runid ORDER BY r.id, g.time")
    with sqlite3.connect(tmp_path / "c.db") as database:
        found = database.execute(query).fetchall()
    assert [row[1:] for row in found if row[0] == longer["transitions"]] == [
        (1e-7, 1, 0.125, None), (0.5, 51, 0.25, 7.0), (0.75, 61, None, 6.0), (1.5, 71, None, 4.0)]
    unsolved = {record["transitions"] for record in never}
    assert {row[4] for row in found if row[0] in unsolved} == {None}
    assert {row[4] for row in found if row[0] not in unsolved} == {None, 7.0, 6.0, 4.0}


def test_what_an_experiment_says(database, sweep):
    found = database.execute("SELECT version, runcount, timelimit, memorylimit, transition_limit, seed, setup "
                             "FROM experiments").fetchall()
    assert [row[:6] for row in found] == [(f"OMPL {sweep.versions['ompl']}", 2, None, 500.0, 100, "4")] * 2
    assert json.loads(found[0][6]) == sweep.config()
    assert database.execute("SELECT name, settings FROM plannerConfigs").fetchall() == \
        [("Ex", 'bin_size = [0.1, 0.2]\n;batch = "grow"\n;control_duration = 1\n;'),
         ("RRT", "goal_bias = 0.0\n;intermediate_states = false\n;control_duration = 1\n;")]
    assert len(database.execute("SELECT * FROM bestPlannerConfigsPerExperiment").fetchall()) == 4


def test_the_log_says_the_same_to_the_command_of_ompl(sweep, records, tmp_path, capsys):
    """`ompl_benchmark_statistics` calls this reader; so a user may put several comparisons into one database."""
    logs = [str(log) for log in write_logs(tmp_path, sweep, records)]
    for _ in range(2):
        readBenchmarkLog(str(tmp_path / "both.db"), logs, False)
    with sqlite3.connect(tmp_path / "both.db") as both:
        assert both.execute("SELECT count(*) FROM runs").fetchone() == (2 * len(records),)
        assert both.execute("SELECT count(*) FROM plannerConfigs").fetchone() == (2,)


def test_folder_that_cannot_be_written():
    with pytest.raises(RunFolderError, match="cannot write"):
        write_database(Path("/nowhere/c.db"), [])


def test_what_is_published_names_no_machine_and_can_be_read_by_others(sweep, records, tmp_path):
    (log,) = write_logs(tmp_path, sweep, records)[:1]
    write_database(tmp_path / "c.db", [log])
    assert f"Running on {platform.machine()}" in log.read_text()
    assert platform.node() == platform.machine() or platform.node() not in log.read_text().split()
    assert (tmp_path / "c.db").stat().st_mode == log.stat().st_mode
