"""The progress of a training as a table that grows: progress.csv, which other processes may read meanwhile."""

import csv
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.results.files import is_there, write_errors

PROGRESS = "progress.csv"
COLUMNS = ("phase", "seconds", "transitions", "updates", "covered", "skills", "start", "success_rate", "actor_loss",
           "critic_loss")
SECONDS_BETWEEN_ROWS = 1.0


class ProgressLog:
    """Appends a row for the plain numbers of a `ProgressCallback`, at most one a second, and the first of each phase.

    Args:
        path: The file; rows of a training that is resumed follow those before.
    """

    def __init__(self, path: Path):
        self._path, self._next, self._phase = path, 0.0, ""
        with write_errors(path):
            if not is_there(path):
                path.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")

    def __call__(self, numbers: Mapping[str, Any], *, last: bool = False) -> None:
        """Append a row; `last` says that no other follows, so that it is written in any case."""
        now, phase = time.monotonic(), str(numbers.get("phase", ""))
        if now < self._next and phase == self._phase and not last:
            return
        self._next, self._phase = now + SECONDS_BETWEEN_ROWS, phase
        with write_errors(self._path), open(self._path, "a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow([_short(numbers.get(name)) for name in COLUMNS])


def read_progress(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a table; numbers that are not there are None.

    Raises:
        DamagedFile: there is no such file, or it holds something else.
    """
    try:
        with open(path, encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if None not in row and None not in row.values()]
        return [{name: text if name == "phase" else float(text) if text else None for name, text in row.items()}
                for row in rows]
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist; pbcs train writes it") from error
    except (OSError, ValueError, csv.Error) as error:
        raise DamagedFile(f"{path} is damaged: {error}") from error


def _short(value: Any) -> Any:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else value
