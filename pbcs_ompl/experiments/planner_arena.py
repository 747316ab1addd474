"""A comparison for OMPL's own tools: benchmark logs, one for each environment, and the database of Planner Arena."""

import io
import json
import os
import platform
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stdout
from datetime import datetime
from operator import itemgetter
from pathlib import Path
from secrets import token_hex
from typing import Any

from ompl.tools import computeViews, readBenchmarkLog

from pbcs_ompl.core.plain import plain
from pbcs_ompl.experiments.planning_run import folder_of
from pbcs_ompl.experiments.run import Record
from pbcs_ompl.experiments.sweep import Sweep
from pbcs_ompl.results.files import write_errors, write_text
from pbcs_ompl.results.provenance import provenance

STATUS = ("Unknown status", "Invalid start", "Invalid goal", "Unrecognized goal type", "Timeout",
          "Approximate solution", "Exact solution", "Crash", "Abort", "Infeasible")
TIMEOUT, EXACT, CRASH = 4, 6, 7
PROPERTIES: dict[str, Callable[[Record], Any]] = {
    "time REAL": itemgetter("seconds"), "memory REAL": itemgetter("memory"),
    "status ENUM": lambda record: EXACT if record["solved"] else CRASH if record["seconds"] is None else TIMEOUT,
    "solved BOOLEAN": itemgetter("solved"), "correct solution BOOLEAN": itemgetter("replay_ok"),
    "solution length REAL": itemgetter("path_length"), "graph states INTEGER": itemgetter("nodes"),
    "transitions INTEGER": itemgetter("transitions"), "collision checks INTEGER": itemgetter("collision_checks"),
    "path length INTEGER": itemgetter("path_length"), "replay ok BOOLEAN": itemgetter("replay_ok"),
    "coverage REAL": itemgetter("coverage"), "seed INTEGER": itemgetter("seed"),
}
"""The columns of a run: those of OMPL's own benchmark, from the transitions on ours."""
PROGRESS = ("time REAL", "transitions INTEGER", "coverage REAL", "best cost REAL")
"""The columns of a sample; the cost of a solution is its steps, under the name that OMPL's planners use."""


def write_logs(folder: Path, sweep: Sweep, records: Sequence[Record]) -> list[Path]:
    """Write a log for each environment into a folder, atomically, and return their paths.

    Args:
        folder: The folder.
        sweep: What was compared.
        records: Those of all runs that were made.

    Source of the grammar: OMPL, "Benchmarking", "The benchmark logfile format".

    Raises:
        RunFolderError: a file cannot be written.
    """
    files = []
    for number, environment in enumerate(sweep.environments, start=1):
        chosen = [record for record in records if folder_of(record) == sweep.folder(number)]
        files.append(folder / f"comparison-{sweep.folder(number)}.log")
        lines = list(_preamble(sweep, environment.label, chosen))
        for planner in sweep.planners:
            lines += _planner(sweep, planner, [record for record in chosen if record["planner"] == planner])
        write_text(files[-1], "\n".join(lines) + "\n")
    return files


def write_database(path: Path, logs: Sequence[Path]) -> None:
    """Make the database from benchmark logs with OMPL's own reader, atomically; an older one is replaced.

    Args:
        path: The database.
        logs: What `write_logs` returned.

    Raises:
        RunFolderError: the file cannot be written.
    """
    with write_errors(path):
        temporary = path.with_name(f".{path.name}.{token_hex(4)}")  # tempfile would hide it from all other users
        try:
            temporary.touch(exist_ok=False)
            with redirect_stdout(io.StringIO()):  # it prints what it does
                readBenchmarkLog(str(temporary), [str(log) for log in logs], False)
                computeViews(str(temporary), False)
            os.replace(temporary, path)
        except sqlite3.OperationalError as error:
            raise OSError(f"SQLite: {error}") from error
        finally:
            temporary.unlink(missing_ok=True)


def _preamble(sweep: Sweep, experiment: str, records: Sequence[Record]) -> Iterator[str]:
    yield f"OMPL version {sweep.versions['ompl']}"
    yield f"Experiment {_word(experiment)}"
    yield "1 experiment properties"
    yield f"transition_limit INTEGER = {sweep.max_transitions}"
    yield f"Running on {platform.machine() or 'unknown'}"  # not the name of the machine: logs are published
    yield f"Starting at {datetime.now().isoformat(sep=' ', timespec='seconds')}"
    yield from _block(json.dumps(sweep.config(), default=plain))
    yield from _block(provenance()["processor"])
    yield f"{sweep.seeds[0]} is the random seed"
    yield f"{_data(sweep.max_seconds) or 'nan'} seconds per run"
    yield f"{_data(sweep.max_memory) or 'nan'} MB per run"
    yield f"{len(sweep.seeds)} runs per planner"
    yield f"{sum(record['seconds'] or 0.0 for record in records)} seconds spent to collect the data"
    yield "1 enum type"
    yield "|".join(("status", *STATUS))
    yield f"{len(sweep.planners)} planners"


def _planner(sweep: Sweep, planner: str, records: Sequence[Record]) -> Iterator[str]:
    options = sweep.planners[planner]
    yield planner
    yield f"{len(options)} common properties"
    yield from (f"{name} = {json.dumps(value, default=plain)}" for name, value in options.items())
    yield f"{len(PROPERTIES)} properties for each run"
    yield from PROPERTIES
    yield f"{len(records)} runs"
    yield from ("".join(f"{_data(measure(record))}; " for measure in PROPERTIES.values()) for record in records)
    yield f"{len(PROGRESS)} progress properties for each run"
    yield from PROGRESS
    yield f"{len(records)} runs"
    yield from (_series(record) for record in records)
    yield "."


def _series(record: Record) -> str:
    """Return the measurements of a run as `time,transitions,coverage,cost,;...;`, one for each time.

    The coverage of a plan that was made shorter after its search is known until then.
    """
    progress = record["progress"] or {"seconds": [], "transitions": [], "coverage": []}
    shares = {time: (made, share) for time, made, share in zip(progress["seconds"], progress["transitions"],
                                                               progress["coverage"], strict=True)}
    costs = {time: (made, cost) for time, made, cost in _costs(record)}
    series, best = "", None
    for time in sorted(shares | costs):
        made, share = shares.get(time, (None, None))
        made, best = costs.get(time, (made, best))
        series += "".join(f"{_data(value)}," for value in (time, made, share, best)) + ";"
    return series


def _costs(record: Record) -> list[tuple[float, int, int]]:
    """Return after how many seconds and transitions a run had a shorter plan, and its steps."""
    if not record["solved"]:
        return []
    note = record.get("improvement")
    if note is None:
        return [(record["seconds"], record["transitions"], record["path_length"])]
    progress = note["progress"]
    return [(record["seconds"] + seconds, record["transitions"] + made, length) for seconds, made, length
            in zip(progress["seconds"], progress["transitions"], progress["length"], strict=True)]


def _data(value: Any) -> str:
    """Return a number as the log has it: nothing where there is none, truth as 1 or 0."""
    return "" if value is None else str(int(value)) if isinstance(value, bool) else str(value)


def _word(text: str) -> str:
    """Return a name as the log has it, without spaces; different names stay different, spaces become %20."""
    return "".join(f"%{ord(letter):02X}" if letter.isspace() or letter == "%" else letter for letter in text)


def _block(text: str) -> Iterator[str]:
    yield from ("<<<|", text, "|>>>")
