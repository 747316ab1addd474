"""The answer of a comparison, merged from the records of its runs."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.experiments.compare.paired import holm, sign_tests
from pbcs_ompl.experiments.compare.records import read_records
from pbcs_ompl.experiments.compare.run import Record, folder_of
from pbcs_ompl.experiments.compare.statistics import row
from pbcs_ompl.experiments.compare.sweep import Sweep
from pbcs_ompl.results.folder import CONFIG, read_toml

DATABASE = "comparison.db"


@dataclass(frozen=True, eq=False)
class Comparison:
    """The answer of a comparison.

    Attributes:
        rows: One for each environment and planner, in the order given: `environment`, and what `statistics.row` says.
        tests: One for each environment and pair of planners: `environment`, what `paired.sign_tests` says, and
            `p_holm`, corrected for the number of all tests of the comparison.
        runs: One record for each run.
        database: The database for Planner Arena; None when no folder was asked for.
    """

    rows: list[dict[str, Any]]
    tests: list[dict[str, Any]]
    runs: list[Record]
    database: str | None

    def by_environment(self) -> dict[str, dict[str, list[Record]]]:
        """Return the records of each planner in each environment, by their names, in order."""
        grouped: dict[str, dict[str, list[Record]]] = {}
        for record in self.runs:
            label = EnvSpec.from_dict(record["environment"]).label
            grouped.setdefault(label, {}).setdefault(record["planner"], []).append(record)
        return grouped

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words."""
        return {"rows": self.rows, "tests": self.tests, "database": self.database}


def read_comparison(folder: str | Path) -> Comparison:
    """Return what `compare` has recorded in a folder so far; nothing is written.

    Raises:
        DamagedFile: the folder holds no comparison, or a record in it is damaged.
    """
    path = Path(folder)
    config = read_toml(path / CONFIG)
    if "environments" not in config:
        raise DamagedFile(f"{path} holds no comparison of planners")
    sweep = Sweep.from_config(config)
    return merge(sweep, read_records(path, sweep), path)


def merge(sweep: Sweep, records: Mapping[str, Record], folder: Path | None) -> Comparison:
    """Return the answer that records by their names give, of all runs of a sweep or of some."""
    rows: list[dict[str, Any]] = []
    tests: list[dict[str, Any]] = []
    runs: list[Record] = []
    for number, environment in enumerate(sweep.environments, start=1):
        chosen = [record for record in records.values() if folder_of(record) == sweep.folder(number)]
        grouped = _by_planner(sweep, chosen)
        label = {"environment": environment.label}
        rows += [label | row(planner, found, sweep.max_transitions) for planner, found in grouped.items() if found]
        tests += [label | test for test in sign_tests(grouped, sweep.max_transitions)]
        runs += [record for found in grouped.values() for record in found]
    for test, corrected in zip(tests, holm([test["p"] for test in tests]), strict=True):
        test["p_holm"] = corrected
    return Comparison(rows, tests, runs, None if folder is None else str(folder / DATABASE))


def _by_planner(sweep: Sweep, records: Iterable[Record]) -> dict[str, list[Record]]:
    """Return the records of each planner, in the order of the seeds."""
    order = {seed: place for place, seed in enumerate(sweep.seeds)}
    grouped: dict[str, list[Record]] = {planner: [] for planner in sweep.planners}
    for record in sorted(records, key=lambda record: order[record["seed"]]):
        grouped[record["planner"]].append(record)
    return grouped
