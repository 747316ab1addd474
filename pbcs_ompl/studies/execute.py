"""Run a study: every run in a process of its own, one file for each record, then the analysis."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.compare.pool import run_all
from pbcs_ompl.core.contracts import ProgressCallback
from pbcs_ompl.core.errors import InvalidOption, PbcsError
from pbcs_ompl.core.run_folder import open_run, read_json, write_json
from pbcs_ompl.studies.claims import Claim
from pbcs_ompl.studies.study import Record, Settings, Study, find_study

RUNS, FIGURES = "runs", "figures"


class Job(NamedTuple):
    """One run, as another process is told of it."""

    study: str
    settings: Settings


class Outcome(NamedTuple):
    """What came of a run: a record, or the reason why there is none."""

    name: str
    record: Record | None
    reason: str


@dataclass(frozen=True)
class StudyResult:
    """The answer of a study.

    Attributes:
        id: Which study.
        records: What every finished run found, in the order of the sweep.
        failed: The reasons of the runs that did not come to an end, by name.
        out: The folder with the files.
        figures: The pictures.
        agrees: The claims.
    """

    id: str
    records: list[Record]
    failed: dict[str, str]
    out: str
    figures: list[str]
    agrees: list[Claim]

    def summary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"id": self.id, "runs": len(self.records), "failed": self.failed, "out": self.out,
                "figures": self.figures, "agrees": [claim.to_dict() for claim in self.agrees]}


def run_study(study: Study, *, out: str | Path, seeds: int | None = None, jobs: int = 1,
              on_progress: ProgressCallback | None = None) -> StudyResult:
    """Make the runs of a study that are not there yet, and analyse all of them.

    A study that was stopped, however, goes on in the same `out`: finished runs are read, not repeated. So does one that
    is called again with more seeds. Runs that failed are tried again.

    Args:
        out: The folder for config.toml, result.json, runs/<name>.json and figures/.
        seeds: How many seeds; as the study says by default.
        jobs: How many processes work at a time.
        on_progress: Called with {"runs", "failed"} when a run ends.

    Raises:
        InvalidOption: fewer than one seed or job.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
        DamagedFile: a record in `out` is damaged.
        PbcsError: two runs of one name, or no run came to an end.
    """
    seeds = study.seeds if seeds is None else seeds
    if seeds < 1 or jobs < 1:
        raise InvalidOption(f"seeds={seeds}, jobs={jobs}: expected at least 1 of each")
    settings = study.runs(study.sweep, seeds)
    _check_names(settings)
    with open_run(Path(out), {"study": study.id, **study.sweep}) as folder:
        records, failed = _records(study, settings, jobs, folder.path, on_progress)
        if not records:
            name, reason = next(iter(failed.items()))
            raise PbcsError(f"no run of {study.id} came to an end; {name}: {reason}")
        figures = folder.path / FIGURES
        figures.mkdir(exist_ok=True)
        claims = study.analyse(records, figures)
        result = StudyResult(study.id, records, failed, str(folder.path),
                             [str(path) for path in sorted(figures.glob("*.png"))], claims)
        folder.write_result(result.summary())
    return result


def _records(study: Study, settings: Sequence[Settings], workers: int, folder: Path,
             on_progress: ProgressCallback | None) -> tuple[list[Record], dict[str, str]]:
    files = {one["name"]: folder / RUNS / f"{one['name']}.json" for one in settings}
    records: dict[str, Record] = {name: read_json(file) for name, file in files.items() if file.is_file()}
    failed: dict[str, str] = {}
    _report(records, failed, on_progress)
    missing = [Job(str(study.folder.resolve()), one) for one in settings if one["name"] not in records]
    for name, record, reason in run_all(missing, workers, _run, _failure):
        if record is None:
            failed[name] = reason
        else:
            write_json(files[name], record)
            records[name] = read_json(files[name])
        _report(records, failed, on_progress)
    return [records[name] for name in files if name in records], failed


def _run(job: Job) -> Outcome:
    """Make one run, in a process that may have made others."""
    study = find_study(job.study)
    try:
        return Outcome(job.settings["name"], study.run(job.settings), "")
    except PbcsError as error:
        return _failure(job, str(error))


def _failure(job: Job, reason: str) -> Outcome:
    return Outcome(job.settings["name"], None, " ".join(reason.split()))


def _check_names(settings: Sequence[Settings]) -> None:
    names = [str(one["name"]) for one in settings]
    if not names or len(set(names)) < len(names) or any("/" in name for name in names):
        raise PbcsError(f"the runs of a study need names of their own, without slashes; got {names[:5]}")


def _report(records: dict[str, Record], failed: dict[str, str], on_progress: ProgressCallback | None) -> None:
    if on_progress is not None:
        on_progress({"runs": len(records) + len(failed), "failed": len(failed)})
