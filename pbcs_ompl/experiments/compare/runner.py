"""Compare planners: planners x environments x seeds, each run recorded, with intervals and paired tests."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from pathlib import Path

from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import MissingDependency, PlannerUnavailable
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.types import Counter, ProgressCallback
from pbcs_ompl.experiments.compare.benchmark_log import write_logs
from pbcs_ompl.experiments.compare.comparison import DATABASE, Comparison, merge
from pbcs_ompl.experiments.compare.database import write_database
from pbcs_ompl.experiments.compare.records import read_records, record_file
from pbcs_ompl.experiments.compare.run import Job, Record, broken, run
from pbcs_ompl.experiments.compare.sweep import Options, Sweep, make_sweep, pair_environments
from pbcs_ompl.experiments.compare.tally import Tally
from pbcs_ompl.experiments.workers import Executor, check_resources, run_all
from pbcs_ompl.resettable import make
from pbcs_ompl.results.folder import RESULT, open_run, write_json

SECONDS_OF_GRACE = 20.0
"""A run may take so much longer than its budget of seconds, to build, warm up and replay, before it is killed."""


def compare(planners: Sequence[str] | Mapping[str, Options], env: str | EnvSpec | Sequence[str | EnvSpec], *,
            env_kwargs: Options | Sequence[Options] | None = None, goal: str | None = None,
            feature: str | None = None, start_seed: int | None = None, seeds: int | Sequence[int] = 10,
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
            of either for all of the other. An `EnvSpec` has its options already.
        goal, feature, start_seed: Rules of all environments; see `pbcs_ompl.make`.
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
        UnknownName, InvalidOption, NotResettable, UnsupportedSpace: wrong input.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
        DamagedFile: a record in `out` is damaged.
    """
    environments = pair_environments(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed)
    sweep = make_sweep(planners, environments, seeds, max_transitions, max_seconds, max_memory)
    check_resources(jobs)
    unavailable = _unavailable(sweep)
    folder = None if out is None else Path(out)
    with nullcontext() if folder is None else open_run(folder, sweep.config(), may_change=("seeds",)):
        records = {} if folder is None else read_records(folder, sweep)
        tally = Tally(sweep, on_progress)
        tally.add_all(records.values())
        for record in _make(sweep, [job for job in sweep.jobs() if job.name not in records], unavailable, jobs):
            records[record["name"]] = record
            if folder is not None:
                write_json(record_file(folder, record["name"]), record)
            tally.add(record)
        comparison = merge(sweep, records, folder)
        if folder is not None:
            write_database(folder / DATABASE, write_logs(folder, sweep, comparison.runs))
            write_json(folder / RESULT, comparison.summary())
    return comparison


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
                with make_problem(make(sweep.environments[0]), counter=Counter(1)) as problem, quiet_ompl():
                    spec.build(problem.space_information, 0)
        except (PlannerUnavailable, MissingDependency) as error:
            reasons[planner] = str(error)
    return reasons
