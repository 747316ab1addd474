"""A comparison as the SQLite database that Planner Arena opens."""

import io
import os
import sqlite3
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

from ompl.tools import computeViews, readBenchmarkLog

from pbcs_ompl.results.folder import clear_write_errors


def write_database(path: Path, logs: Sequence[Path]) -> None:
    """Have OMPL's own reader make the database of benchmark logs, atomically; an older one is replaced.

    Raises:
        RunFolderError: the file cannot be written.
    """
    with clear_write_errors(path):
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        os.close(handle)
        try:
            with redirect_stdout(io.StringIO()):  # it says what it does
                readBenchmarkLog(temporary, [str(log) for log in logs], False)
                computeViews(temporary, False)
            os.replace(temporary, path)
        except sqlite3.OperationalError as error:
            raise OSError(f"SQLite: {error}") from error
        finally:
            Path(temporary).unlink(missing_ok=True)
