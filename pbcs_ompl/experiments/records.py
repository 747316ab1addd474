"""The records of an experiment: one file for each run, read when the experiment is resumed."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.experiments.run import Failure, Record, Run, RunFunction
from pbcs_ompl.experiments.workers import Executor, Limits
from pbcs_ompl.results.checksums import Checksums, write_summed_json
from pbcs_ompl.results.files import RUNS, is_there, read_json

REMEDY = "remove the file to have this run made again"


class Results(NamedTuple):
    """What the runs of an experiment found, by their names."""

    records: dict[str, Record]
    failures: dict[str, Failure]


def record_file(folder: Path, name: str) -> Path:
    """Return the file of the record of a run in the folder of its experiment."""
    return folder / RUNS / f"{name}.json"


def read_records(folder: Path, runs: Sequence[Run], kind: Any = dict[str, Any]) -> dict[str, Record]:
    """Return the records of the runs that were made, by their names.

    Args:
        folder: The folder of the experiment.
        runs: The runs.
        kind: What a record holds: a type of `results.schema`.

    Raises:
        DamagedFile: a record is damaged. It is never replaced silently: what damaged it may have damaged others.
    """
    files = {run.name: record_file(folder, run.name) for run in runs}
    sums = {place: Checksums(place) for place in {file.parent for file in files.values()}}
    return {name: _read_record(file, kind, sums[file.parent]) for name, file in files.items() if is_there(file)}


def _read_record(file: Path, kind: Any, sums: Checksums) -> Record:
    try:
        record: Record = read_json(file, kind, finite=False)  # a study may record NaN
    except DamagedFile as error:
        raise DamagedFile(f"{error}; {REMEDY}") from error
    if sums.is_changed(file):
        raise DamagedFile(f"{file} was changed after it was written; {REMEDY}")
    return record


def make_missing_runs(runs: Sequence[Run], function: RunFunction, known: Mapping[str, Record], *, folder: Path | None,
                      executor: Executor, limits: Limits, on_end: Callable[[Record | Failure], None],
                      failed_record: Callable[[Run, Failure], Record] | None = None) -> Results:
    """Make the runs that have no record yet, and write the record of each as soon as it ends.

    Args:
        runs: All runs of the experiment.
        function: Makes a run.
        known: The records of the runs that were made before, by name.
        folder: Where to write the records; None for nowhere.
        executor: What executes the runs.
        limits: What each run may use.
        on_end: Called with what a run found, when it ends.
        failed_record: Returns the record that a failed run gets; None if it gets none, and is made again next time.

    Returns:
        The records in the order of the runs, and the failures.
    """
    records, failures = dict(known), {}
    missing = [run for run in runs if run.name not in records]
    with code_of_others("the executor"):
        running = executor(missing, function, limits)
    with closing(running) as ended:
        for run, found in ended:
            if isinstance(found, Failure) and failed_record is not None:
                found = failed_record(run, found)
            if isinstance(found, Failure):
                failures[run.name] = found
            else:
                records[run.name] = found
                if folder is not None:
                    write_summed_json(record_file(folder, run.name), found)
            on_end(found)
    return Results({run.name: records[run.name] for run in runs if run.name in records}, failures)
