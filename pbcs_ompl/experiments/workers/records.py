"""The record of a run, as a file."""

from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.results.folder import read_json


def read_record(file: Path) -> dict[str, Any]:
    """Return the record in a file.

    Raises:
        DamagedFile: it is none. It is never made again unasked: what made it wrong may have been at others too.
    """
    remedy = "remove the file to have this run made again"
    try:
        record = read_json(file)
    except DamagedFile as error:
        raise DamagedFile(f"{error}; {remedy}") from error
    if not isinstance(record, dict):
        raise DamagedFile(f"{file} is damaged: expected an object, got {type(record).__name__}; {remedy}")
    return record
