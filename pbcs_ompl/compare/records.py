"""The records of a comparison as files, one for each run."""

from pathlib import Path

from pbcs_ompl.compare.run import MEASURED, Record
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.run_folder import read_json

RUNS = "runs"


def record_file(folder: Path, name: str) -> Path:
    """Return where the record of the run `name` lies."""
    return folder / RUNS / f"{name}.json"


def read_record(folder: Path, name: str) -> Record:
    """Return the record of the run `name`.

    Raises:
        DamagedFile: it does not parse, or is not the record of this run. It is never made again unasked: what made
            it wrong may have been at the other records too.
    """
    file = record_file(folder, name)
    try:
        record = read_json(file)
    except DamagedFile as error:
        raise DamagedFile(f"{error}; remove the file to have this run made again") from error
    if not isinstance(record, dict) or record.get("name") != name or not record.keys() >= {*MEASURED, "solved"}:
        raise DamagedFile(f"{file} is not the record of the run {name}; remove the file to have this run made again")
    return record
