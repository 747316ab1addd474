"""`pbcs study`: run an experiment, draw its figures, say which of its claims the data agree with."""

from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import Report, conclude, list_files
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.studies import find_study, run_study, study_ids

VERDICTS = {True: "agrees", False: "DIFFERS", None: "no data"}


def run(arguments: Namespace) -> int:
    """Run, analyse, report. Returns 1 when a run failed; claims that are false are an answer, not a failure."""
    if arguments.list:
        titles = study_ids()
        conclude({"studies": titles}, list(titles.items()), as_json=arguments.json)
        return 0
    if arguments.id is None:
        raise InvalidOption("the id of a study is missing; pbcs study --list shows them all")
    study = find_study(arguments.id)
    seeds = study.seeds if arguments.seeds is None else arguments.seeds
    out = Path(arguments.out or fresh_folder("study", study.id, seeds))
    try:
        with Report(study.id, count="runs", budget=len(study.runs(study.sweep, seeds))) as report:
            result = run_study(study, out=out, seeds=seeds, jobs=arguments.jobs, on_progress=report)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"go on with the same command and --out {out}") from None
    summary = result.summary()
    conclude(summary, _closing_lines(study.title, summary, out), as_json=arguments.json)
    return 1 if result.failed else 0


def _closing_lines(title: str, summary: dict[str, Any], out: Path) -> list[tuple[str, str]]:
    lines = [(summary["id"], f"{title}: {summary['runs']} runs")]
    for claim in summary["agrees"]:
        lines.append((VERDICTS[claim["agrees"]], f"{claim['claim']}  ({claim['source']})"))
        lines += [("", f"{name}: {_words(value)}") for name, value in claim["numbers"].items()]
        lines += [("", claim["note"])] if claim["note"] else []
    lines += [("failed", f"{name}: {reason}") for name, reason in summary["failed"].items()]
    return [*lines, ("figures", ", ".join(summary["figures"]) or "none"), ("files", list_files(out))]


def _words(value: Any) -> str:
    if isinstance(value, dict) and value.get("rate") is not None:
        low, high = value["wilson"]
        return f"{value['successes']}/{value['n']} = {value['rate']:.1%} (95 % interval {low:.1%} to {high:.1%})"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
