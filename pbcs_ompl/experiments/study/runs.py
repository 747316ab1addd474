"""The runs of a study: each in a worker process, its record in a file that is whole or absent."""

import json
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.types import ProgressCallback
from pbcs_ompl.experiments.study.study import Record, Settings, Study, find_study
from pbcs_ompl.experiments.workers import Executor, read_record, run_all
from pbcs_ompl.results.folder import write_json

RUNS = "runs"


class Made(NamedTuple):
    """What came of the runs: records, and the reasons of those that did not come to an end, by name."""

    records: dict[str, Record]
    failed: dict[str, str]


class Job(NamedTuple):
    """One run, as another process is told of it."""

    study: str
    settings: Settings


class Outcome(NamedTuple):
    """What came of a run: a record, or the reason why there is none."""

    name: str
    record: Record | None
    reason: str


def run_settings(study: Study, seeds: int) -> list[Settings]:
    """Return the settings of every run.

    Raises:
        PbcsError: there are none, their names do not serve as names of files, or they are not plain values.
    """
    settings = study.runs(study.sweep, seeds)
    names = [str(one.get("name", "")) for one in settings]
    if not names or len(set(names)) < len(names) or not all(map(_names_a_file, names)):
        raise PbcsError(f"the runs of a study need names of their own, without slashes; got {names[:5]}")
    try:
        json.dumps(settings, default=plain)
    except TypeError as error:
        raise PbcsError(f"the settings of the runs of {study.id} must be plain values: {error}") from error
    return settings


def _names_a_file(name: str) -> bool:
    return bool(name) and "/" not in name and name.isprintable()


def record_name(settings: Settings) -> str:
    """Return the file of the record of a run, relative to the folder of the study's results."""
    return f"{RUNS}/{settings['name']}.json"


def make_runs(study: Study, settings: Sequence[Settings], folder: Path, *, jobs: int | Executor,
              max_seconds: float | None, max_memory: float | None, on_progress: ProgressCallback | None) -> Made:
    """Read the records that are there, make the runs whose records are not.

    Raises:
        DamagedFile: a record is damaged.
    """
    files = {str(one["name"]): folder / record_name(one) for one in settings}
    made = Made({name: read_record(file) for name, file in files.items() if file.is_file()}, {})
    _report(made, on_progress)
    missing = [Job(str(study.folder.resolve()), one) for one in settings if str(one["name"]) not in made.records]
    with closing(run_all(missing, jobs, _run, _failure, max_seconds=max_seconds, max_memory=max_memory)) as outcomes:
        for name, record, reason in outcomes:
            if record is None:
                made.failed[name] = reason
            else:
                write_json(files[name], record)
                made.records[name] = record
            _report(made, on_progress)
    return Made({name: made.records[name] for name in files if name in made.records}, made.failed)


def _run(job: Job) -> Outcome:
    """Make one run, in a process that may have made others; the record is as it will be read from its file."""
    study = find_study(job.study)
    try:
        record = study.run(job.settings)
    except PbcsError as error:
        return _failure(job, str(error))
    return Outcome(str(job.settings["name"]), json.loads(json.dumps(record, default=plain)), "")


def _failure(job: Job, reason: str) -> Outcome:
    return Outcome(str(job.settings["name"]), None, " ".join(reason.split()))


def _report(made: Made, on_progress: ProgressCallback | None) -> None:
    if on_progress is not None:
        on_progress({"runs": len(made.records) + len(made.failed), "failed": len(made.failed)})
