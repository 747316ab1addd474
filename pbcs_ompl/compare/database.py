"""A comparison as the SQLite database that Planner Arena and OMPL's own tools read."""

import json
import os
import platform
import sqlite3
import tempfile
from collections.abc import Sequence
from contextlib import closing
from datetime import datetime
from pathlib import Path
from typing import Any

from pbcs_ompl.compare.statistics import Record
from pbcs_ompl.core.run_folder import clear_write_errors, plain

SCHEMA = """
CREATE TABLE experiments (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512), totaltime REAL, timelimit
REAL,
    memorylimit REAL, runcount INTEGER, version VARCHAR(128), hostname VARCHAR(1024), cpuinfo TEXT, date
    DATETIME, seed VARCHAR(24), setup TEXT, transition_limit INTEGER);
CREATE TABLE plannerConfigs (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512) NOT NULL, settings TEXT);
CREATE TABLE enums (name VARCHAR(512), value INTEGER, description TEXT, PRIMARY KEY (name, value));
CREATE TABLE runs (id INTEGER PRIMARY KEY AUTOINCREMENT, experimentid INTEGER, plannerid INTEGER, time REAL,
    memory REAL, status ENUM, solved BOOLEAN, transitions INTEGER, solution_length REAL, solution_segments
    INTEGER, correct_solution BOOLEAN, graph_states INTEGER, seed INTEGER, FOREIGN KEY (experimentid)
    REFERENCES experiments(id) ON DELETE CASCADE, FOREIGN KEY (plannerid) REFERENCES plannerConfigs(id) ON
    DELETE CASCADE);
CREATE TABLE progress (runid INTEGER, time REAL, PRIMARY KEY (runid, time),
    FOREIGN KEY (runid) REFERENCES runs(id) ON DELETE CASCADE);
"""
STATUS = ("Unknown status", "Invalid start", "Invalid goal", "Unrecognized goal type", "Timeout",
          "Approximate solution", "Exact solution", "Crash", "Abort", "Infeasible")
TIMEOUT, EXACT, CRASH = 4, 6, 7


def write_database(path: Path, config: dict[str, Any], records: Sequence[Record]) -> None:
    """Write a comparison as one experiment, atomically.

    The tables are OMPL's (`ompl_benchmark_statistics`): Planner Arena relies on the order of the first 12
    columns of experiments and of the first 3 of runs. Behind them come transitions, which OMPL does not
    know, and the seed.

    Args:
        path: The file; an older one is replaced.
        config: The settings of the comparison, as in its config.toml.
        records: Its runs.

    Raises:
        RunFolderError: the file cannot be written.
    """
    with clear_write_errors(path):
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        os.close(handle)
        try:
            with closing(sqlite3.connect(temporary)) as database, database:
                _fill(database, config, records)
            os.replace(temporary, path)
        except sqlite3.OperationalError as error:
            raise OSError(f"SQLite: {error}") from error
        finally:
            Path(temporary).unlink(missing_ok=True)


def _fill(database: sqlite3.Connection, config: dict[str, Any], records: Sequence[Record]) -> None:
    database.executescript(SCHEMA)
    database.executemany("INSERT INTO enums VALUES ('status', ?, ?)", enumerate(STATUS))
    experiment = database.execute(
        "INSERT INTO experiments VALUES (NULL, ?, ?, ?, NULL, ?, ?, ?, ?, ?, ?, ?, ?)",
        (config["env"], sum(record["seconds"] or 0.0 for record in records), config.get("max_seconds"),
         len(config["seeds"]), f"OMPL {config['versions']['ompl']}", platform.node(), platform.processor(),
         datetime.now().isoformat(sep=" ", timespec="seconds"), str(config["seeds"][0]),
         json.dumps(config, default=plain), config["max_transitions"])).lastrowid
    for planner in config["planners"]:
        settings = json.dumps(config["planner_kwargs"].get(planner, {}), default=plain)
        identity = database.execute(
            "INSERT INTO plannerConfigs VALUES (NULL, ?, ?)", (planner, settings)).lastrowid
        rows = [(experiment, identity, *_measurements(record))
                for record in records if record["planner"] == planner]
        database.executemany("INSERT INTO runs VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)


def _measurements(record: Record) -> tuple[Any, ...]:
    status = EXACT if record["solved"] else CRASH if record["seconds"] is None else TIMEOUT
    length = record["path_length"]
    return (record["seconds"], record["memory"], status, record["solved"], record["transitions"], length,
            length, record["replay_ok"], record["nodes"], record["seed"])
