"""Compare planners: planners x environments x seeds, each run recorded, with intervals and paired tests."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbcs_ompl.bridge.building import PlannerSpec
from pbcs_ompl.bridge.problem import make_problem, quiet_ompl
from pbcs_ompl.compare.benchmark_log import write_logs
from pbcs_ompl.compare.database import write_database
from pbcs_ompl.compare.paired import holm, sign_tests
from pbcs_ompl.compare.records import read_record, record_file
from pbcs_ompl.compare.run import Job, Record, broken, folder_of, run
from pbcs_ompl.compare.statistics import row
from pbcs_ompl.compare.sweep import Environment, Options, Sweep, make_sweep
from pbcs_ompl.compare.tally import Tally
from pbcs_ompl.core.contracts import Counter, ProgressCallback
from pbcs_ompl.core.errors import MissingDependency, PlannerUnavailable
from pbcs_ompl.core.run_folder import CONFIG, RESULT, open_run, read_toml, write_json
from pbcs_ompl.execution import Executor, check_resources, run_all
from pbcs_ompl.reset_anywhere import make

DATABASE = "comparison.db"
SECONDS_OF_GRACE = 20.0
"""A run may take so much longer than its budget of seconds, to build, warm up and replay, before it is killed."""


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
        labels = [row["environment"] for row in self.rows]
        grouped: dict[str, dict[str, list[Record]]] = {label: {} for label in labels}
        for record in self.runs:
            label = Environment(record["env"], record["env_kwargs"]).label
            grouped[label].setdefault(record["planner"], []).append(record)
        return grouped

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words."""
        return {"rows": self.rows, "tests": self.tests, "database": self.database}


def compare(planners: Sequence[str] | Mapping[str, Options], env: str | Sequence[str], *,
            env_kwargs: Options | Sequence[Options] | None = None, seeds: int | Sequence[int] = 10,
            max_transitions: int = 1_000_000, max_seconds: float | None = None, max_memory: float | None = None,
            jobs: int | Executor = 1, out: str | Path | None = None,
            on_progress: ProgressCallback | None = None) -> Comparison:
    """Run every planner in every environment with every seed, in spawned processes.

    A planner that raises, cannot be built, hangs, eats memory or does not reach the goal is recorded with its reason,
    and the others go on. Seconds are those of the search alone. A comparison that was stopped goes on when it is
    called again with the same settings and `out`, or with other seeds: finished runs are read, not repeated.

    Args:
        planners: Registered names or `module:attribute`, which other processes have to find; or their options by name.
        env, env_kwargs: Environments by their Gymnasium ids, and their options: as many of one as of the other, or one
            of either for all of the other.
        seeds: How many seeds (0, 1, ...), or the seeds.
        max_transitions, max_seconds: The budget of one run. Planners see to it; one that is still at work 20 seconds
            after `max_seconds` is killed.
        max_memory: MB that the process of one run may hold before it is killed; Python and the libraries take about
            250.
        jobs: How many processes work at a time; more than there are cores makes the seconds meaningless. Or what
            executes the runs elsewhere: see `execution.ray.ray_cluster`.
        out: The folder for all results; see docs/compare.md.
        on_progress: Called when a run ends with {"runs", "solved", "table": what is known of each planner}.

    Raises:
        UnknownName, InvalidOption, NoResetAnywhere, UnsupportedSpace: wrong input.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
        DamagedFile: a record in `out` is damaged.
    """
    sweep = make_sweep(planners, env, {} if env_kwargs is None else env_kwargs, seeds, max_transitions, max_seconds,
                       max_memory)
    check_resources(jobs)
    unavailable = _unavailable(sweep)
    folder = None if out is None else Path(out)
    with nullcontext() if folder is None else open_run(folder, sweep.config(), may_change=("seeds",)):
        records = {} if folder is None else _finished(sweep, folder)
        tally = Tally(sweep, on_progress)
        tally.add_all(records.values())
        for record in _make(sweep, [job for job in sweep.jobs() if job.name not in records], unavailable, jobs):
            records[record["name"]] = record
            if folder is not None:
                write_json(record_file(folder, record["name"]), record)
            tally.add(record)
        comparison = _merge(sweep, records, folder)
        if folder is not None:
            write_database(folder / DATABASE, write_logs(folder, sweep, comparison.runs))
            write_json(folder / RESULT, comparison.summary())
    return comparison


def read_comparison(folder: str | Path) -> Comparison:
    """Return what `compare` has recorded in a folder so far; nothing is written.

    Raises:
        DamagedFile: the folder holds no comparison, or a record in it is damaged.
    """
    path = Path(folder)
    sweep = Sweep.from_config(read_toml(path / CONFIG))
    return _merge(sweep, _finished(sweep, path), path)


def _finished(sweep: Sweep, folder: Path) -> dict[str, Record]:
    names = [job.name for job in sweep.jobs()]
    return {name: read_record(folder, name) for name in names if record_file(folder, name).is_file()}


def _make(sweep: Sweep, jobs: Sequence[Job], unavailable: Mapping[str, str],
          workers: int | Executor) -> Iterator[Record]:
    """Make the runs, those of planners that cannot be loaded here without a process."""
    yield from (broken(job, unavailable[job.planner]) for job in jobs if job.planner in unavailable)
    possible = [job for job in jobs if job.planner not in unavailable]
    seconds = None if sweep.max_seconds is None else sweep.max_seconds + SECONDS_OF_GRACE
    with closing(run_all(possible, workers, run, broken, max_seconds=seconds, max_memory=sweep.max_memory)) as records:
        yield from records


def _unavailable(sweep: Sweep) -> dict[str, str]:
    """Return why planners cannot be loaded here, by their names. A misspelt name or option is an error."""
    reasons = {}
    for planner, options in sweep.planners.items():
        try:
            spec = PlannerSpec(planner, options)
            if options:  # some planners look at them only now
                with make_problem(make(*sweep.environments[0]), counter=Counter(1)) as problem, quiet_ompl():
                    spec.build(problem.space_information, 0)
        except (PlannerUnavailable, MissingDependency) as error:
            reasons[planner] = str(error)
    return reasons


def _merge(sweep: Sweep, records: Mapping[str, Record], folder: Path | None) -> Comparison:
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
