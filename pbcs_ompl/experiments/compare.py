"""Compare planners: planners x environments x seeds, each run recorded, with intervals and paired tests."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.types import ProgressCallback
from pbcs_ompl.experiments.planner_arena import write_database, write_logs
from pbcs_ompl.experiments.planner_statistics import censored, holm, planner_row, sign_tests
from pbcs_ompl.experiments.planning_run import failed_record, folder_of, is_record_of, run_planner
from pbcs_ompl.experiments.records import REMEDY, make_missing_runs, read_records, record_file
from pbcs_ompl.experiments.run import Failure, Record
from pbcs_ompl.experiments.sweep import Environment, Options, Sweep, environment_specs, make_sweep
from pbcs_ompl.experiments.workers import Executor, Limits, make_executor
from pbcs_ompl.results.checksums import write_summed_json
from pbcs_ompl.results.files import CONFIG, RESULT
from pbcs_ompl.results.folder import open_run, read_config
from pbcs_ompl.results.schema import CompareConfig, RunOfComparison, check

DATABASE = "comparison.db"
SECONDS_OF_GRACE = 20.0
"""How much longer than its budget of seconds a run may take, to build, warm up and replay, before it is killed."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """The result of a comparison.

    Attributes:
        rows: One for each environment and planner, in the order given: `environment`, and what `planner_row` returns.
        tests: One for each environment and pair of planners: `environment`, what `sign_tests` returns, and `p_holm`,
            corrected for the number of all tests of the comparison.
        runs: One record for each run.
        database: The database for Planner Arena; None when no folder was asked for.

    Example:
        >>> import pbcs_ompl
        >>> found = pbcs_ompl.compare(["Rides", "Ex"], "pbcs/Maze-v0", seeds=2)
        >>> len(found.runs), len(found.tests)
        (4, 1)
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


@checked
def compare(planners: Sequence[str] | Mapping[str, Options], env: Environment | Sequence[Environment], *,
            env_kwargs: Options | Sequence[Options] | None = None, goal: str | None = None,
            feature: str | None = None, start_seed: int | None = None,
            reset_options: Options | None = None, seeds: int | Sequence[int] = 10,
            max_transitions: int = 1_000_000, max_seconds: float | None = None, max_memory: float | None = None,
            improve: int | str | None = None, jobs: int | Executor = 1, out: str | Path | None = None,
            on_progress: ProgressCallback | None = None) -> Comparison:
    """Run every planner in every environment with every seed, in spawned processes.

    A planner that raises, cannot be built, hangs, uses too much memory or does not reach the goal is recorded with its
    reason, and the other runs continue. A comparison that was stopped is resumed when it is called again with the same
    settings and `out`, or with other seeds: runs that ended are read, not repeated.

    Args:
        planners: Registered names or `module:attribute`, which other processes have to find; or their options by name.
        env: An environment or several: ids, `EnvSpec` objects, and Gymnasium environments or models of a registered id.
        env_kwargs: Options of ids: as many as there are environments, or one of either for all of the other.
        goal, feature, start_seed, reset_options: Rules of all environments; see `pbcs_ompl.make`.
        seeds: How many seeds (0, 1, ...), or the seeds.
        max_transitions: The most environment steps of one run.
        max_seconds: The most wall time of the search of one run; None for any. A planner that has not ended 20 seconds
            later is killed.
        max_memory: MB that the process of one run may hold before it is killed; Python and the libraries take about
            250. None for any.
        improve: What making each plan shorter may use after its search, as in `plan`; None for nothing.
        jobs: How many processes work at a time (with more than there are cores the seconds mean nothing), or what
            executes the runs elsewhere: see `experiments.workers.ray.ray_cluster`.
        out: The folder for all results (see docs/compare.md); None for none.
        on_progress: Called when a run ends with {"runs", "solved", "table": the numbers of each planner so far}.

    Raises:
        UnknownName, InvalidOption, NotResettable, UnsupportedSpace: wrong input.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
        DamagedFile: a record in `out` is damaged.

    Example:
        >>> import pbcs_ompl
        >>> found = pbcs_ompl.compare(["Rides", "Ex"], "pbcs/Maze-v0", env_kwargs={"size": 3}, seeds=2)
        >>> [row["solved"] for row in found.rows]
        [2, 2]
    """
    limits = Limits(None if max_seconds is None else max_seconds + SECONDS_OF_GRACE, max_memory)
    executor = make_executor(jobs)
    environments = environment_specs(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed,
                                     reset_options=reset_options)
    sweep = make_sweep(planners, environments, seeds, max_transitions, max_seconds, max_memory,
                       improve)
    folder = None if out is None else Path(out)
    with nullcontext() if folder is None else open_run(folder, sweep.config(), may_change=("seeds",)):
        known = {} if folder is None else _read_records(folder, sweep)
        progress = _Progress(sweep, on_progress)
        progress.add(known.values())
        made = make_missing_runs(list(sweep.runs()), run_planner, known, folder=folder, executor=executor,
                                 limits=limits, failed_record=failed_record, on_end=progress.add_one)
        comparison = _merge(sweep, made.records, folder)
        if folder is not None:
            write_database(folder / DATABASE, write_logs(folder, sweep, comparison.runs))
            write_summed_json(folder / RESULT, comparison.summary())
    return comparison


def read_comparison(folder: str | Path) -> Comparison:
    """Return what `compare` has recorded in a folder so far; nothing is written.

    Raises:
        DamagedFile: the folder holds no comparison, or a record in it is damaged.
    """
    path = Path(folder)
    config = read_config(path, "compare")
    check(path / CONFIG, config, CompareConfig)
    sweep = Sweep.from_config(config)
    return _merge(sweep, _read_records(path, sweep), path)


def _read_records(folder: Path, sweep: Sweep) -> dict[str, Record]:
    runs = {run.name: run for run in sweep.runs()}
    records = read_records(folder, list(runs.values()), RunOfComparison)
    for name, record in records.items():
        if not is_record_of(runs[name], record):
            raise DamagedFile(f"{record_file(folder, name)} is not the record of the run {name}; {REMEDY}")
    return records


def _merge(sweep: Sweep, records: Mapping[str, Record], folder: Path | None) -> Comparison:
    """Return the result of the runs of a sweep that have a record."""
    rows: list[dict[str, Any]] = []
    tests: list[dict[str, Any]] = []
    runs: list[Record] = []
    for number, environment in enumerate(sweep.environments, start=1):
        chosen = [record for record in records.values() if folder_of(record) == sweep.folder(number)]
        grouped = _by_planner(sweep, chosen)
        label = {"environment": environment.label}
        rows += [label | planner_row(planner, found, sweep.max_transitions)
                 for planner, found in grouped.items() if found]
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


class _Progress:
    """Counts the runs of each planner in each environment, and reports them.

    Args:
        sweep: What is compared.
        on_progress: Called with the counts and a `table`, a dictionary for each row; None for no reports.
    """

    def __init__(self, sweep: Sweep, on_progress: ProgressCallback | None):
        self._sweep, self._on_progress = sweep, on_progress
        self._labels = {sweep.folder(number): place.label for number, place in enumerate(sweep.environments, start=1)}
        self._transitions: dict[tuple[str, str], list[int]] = {key: [] for key in product(self._labels, sweep.planners)}
        self._solved, self._ended = dict.fromkeys(self._transitions, 0), dict.fromkeys(self._transitions, 0)

    def add(self, records: Iterable[Record]) -> None:
        """Count the records of runs that have ended."""
        for record in records:
            key = folder_of(record), record["planner"]
            self._transitions[key].append(censored(record, self._sweep.max_transitions))
            self._solved[key] += record["solved"]
            self._ended[key] += record["seconds"] is not None
        if self._on_progress is not None:
            runs = sum(len(numbers) for numbers in self._transitions.values())
            with code_of_others("on_progress"):
                self._on_progress({"runs": runs, "solved": sum(self._solved.values()),
                                   "table": [*map(self._row, self._solved)]})

    def add_one(self, found: Record | Failure) -> None:
        """Count the record of a run that has just ended; failed runs have one, too."""
        if not isinstance(found, Failure):
            self.add([found])

    def _row(self, key: tuple[str, str]) -> dict[str, Any]:
        folder, planner = key
        numbers = self._transitions[key]
        environment = {"environment": self._labels[folder]} if len(self._labels) > 1 else {}
        return {**environment, "planner": planner,
                "runs": f"{len(numbers)}/{len(self._sweep.seeds)}", "solved": self._solved[key],
                "median transitions": median(numbers) if self._ended[key] else "-"}
