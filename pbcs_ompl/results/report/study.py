"""What a report says of a study."""

from pathlib import Path
from typing import Any

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.formatting import seeds_in_words
from pbcs_ompl.experiments.study import study_ids
from pbcs_ompl.experiments.study.runs import RUNS
from pbcs_ompl.results.folder import read_json
from pbcs_ompl.results.report.content import UNFINISHED, Content, outline, table_of_runs
from pbcs_ompl.results.report.folder import Folder


def study_content(folder: Folder) -> Content:
    """Return what the folder of `pbcs study` holds.

    Raises:
        DamagedFile: a record is damaged.
    """
    files = sorted((folder.path / RUNS).glob("*.json"))
    seeds: set[int] = set()
    outlines = []
    for file in files:
        record = _read(file)
        seeds.update(_seeds(record))
        outlines.append(outline({"run": file.stem} | record))
    study, result = folder.config["study"], folder.result
    title = ": ".join(filter(None, [f"Study {study}", study_ids().get(study)]))
    tables, words = [table_of_runs(outlines, folder.path / RUNS)], seeds_in_words(seeds)
    if result is None:
        return Content(title, f"{UNFINISHED}; {len(files):,} runs made", None, [], words, tables=tables)
    failed = result["failed"]
    return Content(title, _verdict([claim["agrees"] for claim in result["agrees"]]), None,
                   [("runs", f"{result['runs']:,}"), ("failed runs", f"{len(failed):,}")], words,
                   claims=result["agrees"], tables=tables, failures=list(failed.items()))


def _verdict(agrees: list[bool | None]) -> str:
    undecided = f", {agrees.count(None)} undecided" if None in agrees else ""
    return f"{agrees.count(True)} of {len(agrees)} claims true, {agrees.count(False)} false{undecided}"


def _read(file: Path) -> dict[str, Any]:
    record = read_json(file)
    if not isinstance(record, dict):
        raise DamagedFile(f"{file} is damaged: expected a JSON object")
    return record


def _seeds(record: dict[str, Any]) -> list[int]:
    """Return the seeds of a run: one, or those of a stack."""
    return [record["seed"]] if isinstance(record.get("seed"), int) else record.get("seeds", [])
