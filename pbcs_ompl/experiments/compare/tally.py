"""What is known of the runs while they are made."""

from collections.abc import Iterable
from itertools import product
from statistics import median
from typing import Any

from pbcs_ompl.core.types import ProgressCallback
from pbcs_ompl.experiments.compare.run import Record, folder_of
from pbcs_ompl.experiments.compare.statistics import censored
from pbcs_ompl.experiments.compare.sweep import Sweep


class Tally:
    """Counts the runs of each planner in each environment, and tells who watches.

    Args:
        sweep: What is compared.
        on_progress: Called with the counts and a `table`, a dictionary for each row; None when nobody watches.
    """

    def __init__(self, sweep: Sweep, on_progress: ProgressCallback | None):
        self._sweep, self._tell = sweep, on_progress
        self._labels = {sweep.folder(number): place.label for number, place in enumerate(sweep.environments, start=1)}
        self._transitions: dict[tuple[str, str], list[int]] = {key: [] for key in product(self._labels, sweep.planners)}
        self._solved, self._ended = dict.fromkeys(self._transitions, 0), dict.fromkeys(self._transitions, 0)

    def add_all(self, records: Iterable[Record]) -> None:
        """Count records that were there before."""
        for record in records:
            self._count(record)
        self._report()

    def add(self, record: Record) -> None:
        """Count the record of a run that has just ended."""
        self._count(record)
        self._report()

    def _count(self, record: Record) -> None:
        key = folder_of(record), record["planner"]
        self._transitions[key].append(censored(record, self._sweep.max_transitions))
        self._solved[key] += record["solved"]
        self._ended[key] += record["seconds"] is not None

    def _report(self) -> None:
        if self._tell is not None:
            runs = sum(len(numbers) for numbers in self._transitions.values())
            self._tell({"runs": runs, "solved": sum(self._solved.values()), "table": [*map(self._row, self._solved)]})

    def _row(self, key: tuple[str, str]) -> dict[str, Any]:
        folder, planner = key
        numbers = self._transitions[key]
        environment = {"environment": self._labels[folder]} if len(self._labels) > 1 else {}
        return {**environment, "planner": planner,
                "runs": f"{len(numbers)}/{len(self._sweep.seeds)}", "solved": self._solved[key],
                "median transitions": median(numbers) if self._ended[key] else "-"}
