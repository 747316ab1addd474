"""The records of a comparison as files, one for each run."""

from pathlib import Path

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.experiments import workers
from pbcs_ompl.experiments.compare.run import MEASURED, Record
from pbcs_ompl.experiments.compare.sweep import Sweep

RUNS = "runs"


def record_file(folder: Path, name: str) -> Path:
    """Return where the record of the run `name` lies."""
    return folder / RUNS / f"{name}.json"


def read_records(folder: Path, sweep: Sweep) -> dict[str, Record]:
    """Return the records that are there, by the names of their runs.

    Raises:
        DamagedFile: see `read_record`.
    """
    names = [job.name for job in sweep.jobs()]
    return {name: read_record(folder, name) for name in names if record_file(folder, name).is_file()}


def read_record(folder: Path, name: str) -> Record:
    """Return the record of the run `name`.

    Raises:
        DamagedFile: it does not parse, or is not the record of this run.
    """
    file = record_file(folder, name)
    record = workers.read_record(file)
    if record.get("name") != name or not record.keys() >= {*MEASURED, "solved"}:
        raise DamagedFile(f"{file} is not the record of the run {name}; remove the file to have this run made again")
    return record
