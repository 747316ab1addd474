"""Run a study: the runs that were not made yet, then the analysis; or one shard of the runs."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.types import ProgressCallback
from pbcs_ompl.experiments.claims import Claim
from pbcs_ompl.experiments.records import Results, make_missing_runs, read_records, record_file
from pbcs_ompl.experiments.run import Failure, Record, Run, Shard
from pbcs_ompl.experiments.shipped_records import shipped_records
from pbcs_ompl.experiments.study import STUDIES, Study, find_study
from pbcs_ompl.experiments.workers import Executor, Limits, make_executor
from pbcs_ompl.results.checksums import write_summed_json
from pbcs_ompl.results.files import FIGURES
from pbcs_ompl.results.folder import RunFolder, open_run


@dataclass(frozen=True)
class StudyResult:
    """The result of a study.

    Attributes:
        id: Which study.
        records: What every run found, in the order of the sweep.
        failed: The reasons of the runs that failed, by name.
        out: The folder with the files.
        figures: The pictures.
        agrees: The claims.
        left_out: How many runs the records that come with the study lack, by the names of runs without their numbers.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.run_study("control-duration", out="runs/durations", from_records=True)
        >>> result.failed
        {}
    """

    id: str
    records: list[Record]
    failed: dict[str, str]
    out: str
    figures: list[str]
    agrees: list[Claim]
    left_out: dict[str, int]

    def summary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"id": self.id, "runs": len(self.records), "left_out": self.left_out, "failed": self.failed,
                "out": self.out, "figures": self.figures, "agrees": [claim.to_dict() for claim in self.agrees]}


@dataclass(frozen=True)
class StudyRun:
    """Makes a run of a study, in a process that may have made others.

    Attributes:
        study: The folder of the study.
    """

    study: str

    def __call__(self, run: Run) -> Record:
        """Return what the run found."""
        return find_study(self.study).run(run.settings)


@checked
def run_study(study: Study | str | Path, *, out: str | Path, seeds: int | None = None, jobs: int | Executor = 1,
              max_seconds: float | None = None, max_memory: float | None = None, from_records: bool = False,
              on_progress: ProgressCallback | None = None) -> StudyResult:
    """Make the runs of a study that were not made yet, and analyse all of them.

    A study that was stopped, for whatever reason, is resumed in the same `out`: runs that ended are read, not repeated.
    So is one that is called again with more seeds. Runs that failed are made again.

    Args:
        study: A study, its id, or the folder of one.
        out: The folder for config.toml, result.json, runs/<name>.json and figures/.
        seeds: How many seeds; None for as many as the study says.
        jobs: How many processes work at a time, or what executes the runs elsewhere: see
            `experiments.workers.ray.ray_cluster`.
        max_seconds: Wall time of one run, which is killed when it takes longer; None for any.
        max_memory: MB that the process of one run may hold before it is killed; None for any.
        from_records: Make no run: take the records that come with the study, and their number of seeds.
        on_progress: Called with {"runs", "failed"} when a run ends.

    Raises:
        UnknownName: there is no such study.
        InvalidOption: fewer than one seed or job, a limit that is not positive, a study that comes without records.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
        DamagedFile: a record in `out` is damaged.
        PbcsError: two runs of one name, or all runs failed.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.run_study("tree-pitfalls", out="runs/pitfalls", from_records=True)
        >>> len(result.figures)
        2
    """
    chosen, executor, limits = _study(study), make_executor(jobs), Limits(max_seconds, max_memory)
    shipped = shipped_records(chosen) if from_records else None
    seeds, runs = (seeds, chosen.all_runs(seeds)) if shipped is None else (shipped.seeds, [])
    with open_study(chosen, out, seeds) as folder:
        if shipped is None:
            records, failures = _make(chosen, runs, folder.path, executor, limits, on_progress)
        else:
            records, failures = shipped.records, {}
            for name, record in records.items():
                write_summed_json(record_file(folder.path, name), record)
        failed = {name: failure.reason for name, failure in failures.items()}
        if not records:
            name, reason = next(iter(failed.items()))
            raise PbcsError(f"all runs of {chosen.id} failed; {name}: {reason}")
        figures = folder.path / FIGURES
        figures.mkdir(exist_ok=True)
        with code_of_others(f"the analysis of the study {chosen.id}"):
            claims = chosen.analyse(list(records.values()), figures)
        result = StudyResult(chosen.id, list(records.values()), failed, str(folder.path),
                             [str(path) for path in sorted(figures.glob("*.png"))], claims,
                             {} if shipped is None else shipped.left_out)
        folder.write_result(result.summary())
    return result


@checked
def run_shard(study: Study | str | Path, shard: Shard, *, out: str | Path, seeds: int | None = None,
              jobs: int | Executor = 1, max_seconds: float | None = None, max_memory: float | None = None,
              on_progress: ProgressCallback | None = None) -> Results:
    """Make the runs of one shard of a study.

    Other shards of the same number may work in the same folder at the same time, from this or other machines that see
    the same disk. Afterwards `run_study` has only the analysis to do.

    Args:
        study: A study, its id, or the folder of one.
        shard: Which part of the runs.
        out, seeds, jobs, max_seconds, max_memory, on_progress: As in `run_study`.

    Raises:
        UnknownName, InvalidOption, RunFolderError, DamagedFile, PbcsError: as in `run_study`.
    """
    chosen, executor, limits = _study(study), make_executor(jobs), Limits(max_seconds, max_memory)
    runs = shard.of(chosen.all_runs(seeds))
    with open_study(chosen, out, seeds, shard=f"{shard.index}-of-{shard.count}") as folder:
        return _make(chosen, runs, folder.path, executor, limits, on_progress)


def open_study(study: Study, out: str | Path, seeds: int | None = None, *, shard: str = "") -> RunFolder:
    """Open the folder for the results of a study, a new one or one with results; see `open_run`."""
    config = {"kind": "study", "study": study.id, "folder": _published(study.folder),
              "seeds": study.number_of_seeds(seeds), **study.sweep}
    return open_run(Path(out), config, may_change=("folder", "seeds"), shard=shard)


def _published(folder: Path) -> str | None:
    """Return the folder of a study without the user's home; None for a study of the package, which has its id."""
    if folder.parent == STUDIES:
        return None
    home = Path(os.path.expanduser("~"))  # which stays ~ for a user without a home
    return f"~/{folder.relative_to(home)}" if folder.is_relative_to(home) else str(folder)


def _study(study: Study | str | Path) -> Study:
    return study if isinstance(study, Study) else find_study(study)


def _make(study: Study, runs: Sequence[Run], folder: Path, executor: Executor, limits: Limits,
          on_progress: ProgressCallback | None) -> Results:
    """Read the records of some runs, make the other runs."""
    known = read_records(folder, runs)
    ended: list[bool] = [True] * len(known)

    def report() -> None:
        if on_progress is not None:
            with code_of_others("on_progress"):
                on_progress({"runs": len(ended), "failed": ended.count(False)})

    def count(found: Record | Failure) -> None:
        ended.append(not isinstance(found, Failure))
        report()

    report()
    return make_missing_runs(runs, StudyRun(str(study.folder.resolve())), known, folder=folder, executor=executor,
                             limits=limits, on_end=count)
