"""Compare planners: planners x seeds on one environment, each run recorded, with intervals."""

from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from pbcs_ompl.bridge.building import PlannerSpec
from pbcs_ompl.bridge.stopping import Limits, checked_limits
from pbcs_ompl.bridge.versions import planning_versions
from pbcs_ompl.compare.database import write_database
from pbcs_ompl.compare.pool import run_all
from pbcs_ompl.compare.run import Job, broken, run
from pbcs_ompl.compare.statistics import Record, row
from pbcs_ompl.core.contracts import ProgressCallback
from pbcs_ompl.core.errors import (
    InvalidOption,
    MissingDependency,
    PlannerUnavailable,
    did_you_mean,
)
from pbcs_ompl.core.run_folder import RESULT, open_run, read_json, write_json
from pbcs_ompl.reset_anywhere import make

DATABASE = "comparison.db"
RUNS = "runs"
Settings = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Comparison:
    """The answer of a comparison.

    Attributes:
        rows: One for each planner, in the order given; see `statistics.row`.
        runs: One record for each run.
        database: The database for Planner Arena; None when no folder was asked for.
    """

    rows: list[dict[str, Any]]
    runs: list[Record]
    database: str | None

    def summary(self) -> dict[str, Any]:
        """Return the plain numbers and words."""
        return {"rows": self.rows, "database": self.database}


def compare(planners: Sequence[str], env: str, *, env_kwargs: dict[str, Any] | None = None,
            planner_kwargs: dict[str, dict[str, Any]] | None = None, seeds: int | Sequence[int] = 10,
            max_transitions: int = 1_000_000, max_seconds: float | None = None, jobs: int = 1,
            out: str | Path | None = None, on_progress: ProgressCallback | None = None) -> Comparison:
    """Run every planner with every seed, each run in a spawned process.

    A planner that fails, cannot be built or does not reach the goal is recorded with its reason, and the
    others go on. Seconds are those of the search alone. A comparison that was stopped goes on when it is
    called again with the same settings and `out`: finished runs are read, not repeated.

    Args:
        planners: Registered names or `module:attribute`; other processes have to find them.
        env, env_kwargs: The environment, by its Gymnasium id.
        planner_kwargs: For each planner (by its name in `planners`) its options.
        seeds: How many seeds (0, 1, ...), or the seeds.
        max_transitions, max_seconds: The budget of one run.
        jobs: How many processes work at a time; more than there are cores makes the seconds meaningless.
        out: The folder for config.toml, result.json, comparison.db and a JSON file for each run.
        on_progress: Called with {"runs", "solved"} when a run ends.

    Raises:
        UnknownName, InvalidOption, NoResetAnywhere, UnsupportedSpace: wrong input.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
    """
    limits = checked_limits(max_transitions, max_seconds)
    settings = _settings(planners, env, env_kwargs or {}, planner_kwargs or {}, seeds, limits)
    if jobs < 1:
        raise InvalidOption(f"jobs is {jobs}; expected at least 1")
    for planner in settings["planners"]:
        _why_unavailable(planner, settings["planner_kwargs"].get(planner, {}))
    folder = None if out is None else Path(out)
    with nullcontext() if folder is None else open_run(folder, settings):
        records = _records(settings, jobs, folder, on_progress)
        rows = [row(planner, [record for record in records if record["planner"] == planner], max_transitions)
                for planner in planners]
        comparison = Comparison(rows, records, None if folder is None else str(folder / DATABASE))
        if folder is not None:
            write_database(folder / DATABASE, settings, records)
            write_json(folder / RESULT, comparison.summary())
    return comparison


def _settings(planners: Sequence[str], env: str, env_kwargs: dict[str, Any],
              planner_kwargs: dict[str, dict[str, Any]], seeds: int | Sequence[int],
              limits: Limits) -> Settings:
    """Return what the comparison is made of, checked, in plain words."""
    chosen = list(range(seeds)) if isinstance(seeds, int) else [int(seed) for seed in seeds]
    if not chosen or not planners:
        raise InvalidOption(f"got {len(planners)} planners and {len(chosen)} seeds; expected one at least")
    for name in planner_kwargs:
        if name not in planners:
            raise InvalidOption(f"options for {name!r}, which is not compared{did_you_mean(name, planners)}")
    for kind, values in (("planners", list(planners)), ("seeds", chosen)):
        if len(set(values)) < len(values):
            raise InvalidOption(f"{kind} holds something twice: {values}")
    make(env, env_kwargs)
    return {"env": env, "planners": list(planners), "seeds": chosen, **limits._asdict(),
            "env_kwargs": env_kwargs, "planner_kwargs": planner_kwargs, "versions": planning_versions()}


def _records(settings: Settings, workers: int, folder: Path | None,
             on_progress: ProgressCallback | None) -> list[Record]:
    """Make the runs that are not there yet; return all, in the order of planners and seeds."""
    jobs = [Job(planner, seed, settings["env"], settings["env_kwargs"],
                settings["planner_kwargs"].get(planner, {}), settings["max_transitions"],
                settings["max_seconds"])
            for seed in settings["seeds"] for planner in settings["planners"]]
    records: dict[tuple[str, int], Record] = {}
    for record in chain(_finished(jobs, folder), _unavailable(jobs)):
        records.setdefault((record["planner"], record["seed"]), record)
    _report(records, on_progress)
    missing = [job for job in jobs if (job.planner, job.seed) not in records]
    for record in run_all(missing, workers, run, broken):
        records[record["planner"], record["seed"]] = record
        if folder is not None:
            write_json(_file(folder, record["planner"], record["seed"]), record)
        _report(records, on_progress)
    return [records[planner, seed] for planner in settings["planners"] for seed in settings["seeds"]]


def _finished(jobs: Sequence[Job], folder: Path | None) -> Iterator[Record]:
    if folder is not None:
        files = (_file(folder, job.planner, job.seed) for job in jobs)
        yield from (read_json(file) for file in files if file.is_file())


def _unavailable(jobs: Sequence[Job]) -> Iterator[Record]:
    """Yield a record for each run of a planner that cannot be loaded here."""
    reasons = {job.planner: _why_unavailable(job.planner, job.planner_kwargs) for job in jobs}
    for job in jobs:
        reason = reasons[job.planner]
        if reason is not None:
            yield broken(job, reason)


def _why_unavailable(planner: str, options: dict[str, Any]) -> str | None:
    """Return why a planner cannot be loaded here, None when it can. A misspelt one is an error."""
    try:
        PlannerSpec(planner, options)
    except (PlannerUnavailable, MissingDependency) as error:
        return str(error)
    return None


def _report(records: dict[tuple[str, int], Record], on_progress: ProgressCallback | None) -> None:
    if on_progress is not None:
        on_progress({"runs": len(records), "solved": sum(record["solved"] for record in records.values())})


def _file(folder: Path, planner: str, seed: int) -> Path:
    return folder / RUNS / f"{planner.replace(':', '.')}-{seed}.json"
