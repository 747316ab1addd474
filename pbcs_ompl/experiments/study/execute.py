"""Run a study: the runs that are not there yet, then the analysis; or a part of the runs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import InvalidOption, PbcsError
from pbcs_ompl.core.types import ProgressCallback
from pbcs_ompl.experiments.study.claims import Claim
from pbcs_ompl.experiments.study.runs import Made, make_runs, run_settings
from pbcs_ompl.experiments.study.study import Record, Study
from pbcs_ompl.experiments.workers import Executor, Shard, check_resources
from pbcs_ompl.results.folder import RunFolder, open_run

FIGURES = "figures"


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


def run_study(study: Study, *, out: str | Path, seeds: int | None = None, jobs: int | Executor = 1,
              max_seconds: float | None = None, max_memory: float | None = None,
              on_progress: ProgressCallback | None = None) -> StudyResult:
    """Make the runs of a study that are not there yet, and analyse all of them.

    A study that was stopped, however, goes on in the same `out`: finished runs are read, not repeated. So does one that
    is called again with more seeds. Runs that failed are tried again.

    Args:
        out: The folder for config.toml, result.json, runs/<name>.json and figures/.
        seeds: How many seeds; as the study says by default.
        jobs: How many processes work at a time, or what executes the runs elsewhere: see `execution.ray.ray_cluster`.
        max_seconds, max_memory: Wall time and MB of memory of one run, which is killed when it exceeds them.
        on_progress: Called with {"runs", "failed"} when a run ends.

    Raises:
        InvalidOption: fewer than one seed or job, a limit that is not positive.
        RunFolderError: `out` holds something else, is in use, or cannot be written.
        DamagedFile: a record in `out` is damaged.
        PbcsError: two runs of one name, or no run came to an end.
    """
    check_resources(jobs, max_seconds, max_memory)
    settings = run_settings(study, _seeds(study, seeds))
    with open_study(study, out, seeds) as folder:
        records, failed = make_runs(study, settings, folder.path, jobs=jobs, max_seconds=max_seconds,
                                    max_memory=max_memory, on_progress=on_progress)
        if not records:
            name, reason = next(iter(failed.items()))
            raise PbcsError(f"no run of {study.id} came to an end; {name}: {reason}")
        figures = folder.path / FIGURES
        figures.mkdir(exist_ok=True)
        claims = study.analyse(list(records.values()), figures)
        result = StudyResult(study.id, list(records.values()), failed, str(folder.path),
                             [str(path) for path in sorted(figures.glob("*.png"))], claims)
        folder.write_result(result.summary())
    return result


def run_shard(study: Study, shard: Shard, *, out: str | Path, seeds: int | None = None, jobs: int | Executor = 1,
              max_seconds: float | None = None, max_memory: float | None = None,
              on_progress: ProgressCallback | None = None) -> Made:
    """Make the runs of one shard; the other arguments and errors are those of `run_study`.

    Other shards of the same number may work in the same folder at the same time, from this or other machines that see
    the same disk. `run_study` then finds nothing left but to analyse.
    """
    check_resources(jobs, max_seconds, max_memory)
    settings = shard.of(run_settings(study, _seeds(study, seeds)))
    with open_study(study, out, seeds, part=f"{shard.index}-of-{shard.count}") as folder:
        return make_runs(study, settings, folder.path, jobs=jobs, max_seconds=max_seconds, max_memory=max_memory,
                         on_progress=on_progress)


def open_study(study: Study, out: str | Path, seeds: int | None = None, *, part: str = "") -> RunFolder:
    """Open the folder for the results of a study, new or begun; see `open_run`."""
    config = {"kind": "study", "study": study.id, "folder": study.folder, "seeds": _seeds(study, seeds), **study.sweep}
    return open_run(Path(out), config, may_change=("folder", "seeds"), part=part)


def _seeds(study: Study, seeds: int | None) -> int:
    seeds = study.seeds if seeds is None else seeds
    if seeds < 1:
        raise InvalidOption(f"seeds is {seeds}; expected at least 1")
    return seeds
