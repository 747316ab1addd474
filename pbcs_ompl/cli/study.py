"""`pbcs study`: run an experiment, draw its figures, say which of its claims the data agree with."""

import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.executor import executor
from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.signals import with_remedy
from pbcs_ompl.experiments.records import record_file
from pbcs_ompl.experiments.run import Shard
from pbcs_ompl.experiments.run_study import open_study, run_shard, run_study
from pbcs_ompl.experiments.study import Study, find_study, study_ids
from pbcs_ompl.experiments.workers.schedulers import makefile, slurm_script
from pbcs_ompl.results.command_line import command, report_words, shell, study_words
from pbcs_ompl.results.files import write_text

VERDICTS = {True: "agrees", False: "DIFFERS", None: "undecided"}
SHOWN = 2
"""Rates beside a claim on the screen; all its numbers are in `result.json` and in the report."""


def run(arguments: Namespace) -> int:
    """Run, analyse, report. Returns 1 when a run failed; claims that are false are results, not failures."""
    if arguments.list:
        titles = study_ids()
        print_summary({"studies": titles}, list(titles.items()), as_json=arguments.json)
        return 0
    if arguments.id is None:
        raise InvalidOption("the id of a study is missing; pbcs study --list shows them all")
    if arguments.shard is not None and (arguments.emit or not arguments.out):
        raise InvalidOption("--shard makes runs in the --out that all shards share: add --out, leave out --emit")
    if arguments.from_records and (arguments.emit or arguments.shard is not None or arguments.seeds is not None):
        raise InvalidOption("--from-records makes no runs: leave out --emit, --shard and --seeds")
    study = find_study(arguments.id)
    study = study if arguments.device is None else study.on_device(arguments.device)
    arguments.seeds = study.seeds if arguments.seeds is None else arguments.seeds
    out = Path(arguments.out or fresh_folder("study", study.id, arguments.seeds))
    if arguments.emit:
        return _emit(study, arguments, out)
    try:
        return _make(study, arguments, out)
    except KeyboardInterrupt as error:
        raise with_remedy(error, f"continue with the same command and --out {shell(str(out))}") from None


def _make(study: Study, arguments: Namespace, out: Path) -> int:
    """Make the runs, all of them or those of a shard, and print the result."""
    runs = [] if arguments.from_records else study.all_runs(arguments.seeds)
    shard = None if arguments.shard is None else Shard(*arguments.shard)
    budget = len(runs if shard is None else shard.of(runs)) or None
    with executor(arguments) as jobs, ProgressDisplay(study.id, count="runs", budget=budget) as display:
        options = {"out": out, "seeds": arguments.seeds, "jobs": jobs, "max_seconds": arguments.max_seconds,
                   "max_memory": arguments.max_memory, "on_progress": display}
        if shard is None:
            summary = run_study(study, from_records=arguments.from_records, **options).summary()
            lines = _closing_lines(study.title, arguments.id, summary, out)
        else:
            records, failures = run_shard(study, shard, **options)
            failed = {name: failure.reason for name, failure in failures.items()}
            summary = {"id": study.id, "shard": str(shard), "runs": len(records), "failed": failed, "out": str(out)}
            lines = [("study", f"{study.id}, shard {shard}: {len(records)} of {budget} runs"), *_failures(failed),
                     ("next", "the other shards, then the same command without --shard")]
    print_summary(summary, lines, as_json=arguments.json)
    return 1 if summary["failed"] else 0


def _emit(study: Study, arguments: Namespace, out: Path) -> int:
    """Write the runs for a scheduler."""
    limits = [("--max-seconds", arguments.max_seconds), ("--max-memory", arguments.max_memory)]
    words = study_words(study.folder.resolve(), seeds=arguments.seeds, device=arguments.device)
    whole = [sys.executable, "-m", "pbcs_ompl.cli", *words, "--out", str(out.resolve()),
             *(word for option, limit in limits if limit is not None for word in (option, f"{limit:g}"))]
    runs = study.all_runs(arguments.seeds)
    if arguments.emit == "make":
        file, following = out / "Makefile", shell("make", "-C", str(out), "--jobs", "2", "--keep-going")
        text = makefile(whole, [str(record_file(out, run.name).relative_to(out)) for run in runs])
    else:
        file, following = out / "slurm.sh", shell("sbatch", str(out / "slurm.sh"))
        text = slurm_script(whole, len(runs), study.id, out.resolve())
    with open_study(study, out, arguments.seeds):
        write_text(file, text)
    print_summary({"id": study.id, "runs": len(runs), "out": str(out), "file": str(file)},
                  [("study", f"{study.id}: {len(runs)} runs in {file}"), ("next", following)], as_json=arguments.json)
    return 0


def _failures(failed: dict[str, str]) -> list[tuple[str, str]]:
    return [("failed", f"{name}: {reason}") for name, reason in failed.items()]


def _closing_lines(title: str, named: str, summary: dict[str, Any], out: Path) -> list[tuple[str, str]]:
    left_out, remedy = sum(summary["left_out"].values()), command([*study_words(named), "--out", str(out)])
    lines = [("study", f"{summary['id']}, {summary['runs']} runs: {title}")]
    lines += [("left out", f"{left_out} runs; {remedy} makes them")] if left_out else []
    lines += [(VERDICTS[claim["agrees"]], in_one_line(claim)) for claim in summary["agrees"]]
    lines += _failures(summary["failed"])
    pictures = sorted(Path(figure).stem for figure in summary["figures"])
    return [*lines, ("figures", f"{out / 'figures'}/ ({', '.join(pictures) or 'none'})"), ("files", list_files(out)),
            ("numbers", str(out / "result.json")), ("next", command(report_words(out)))]


def in_one_line(claim: dict[str, Any]) -> str:
    """Write a claim, the numbers that say most about it, and what it lacks."""
    numbers = claim["numbers"]
    rates = [f"{value['successes']}/{value['n']}" for value in numbers.values()
             if isinstance(value, dict) and "wilson" in value][:SHOWN]
    chances = [f"p = {value:.2g}" if value else "p < 1e-5" for name, value in numbers.items() if name.startswith("p ")]
    missing = [claim["note"]] if claim["agrees"] is None and claim["note"] else []
    return f"{claim['claim']}: {'; '.join([', '.join(rates + chances), *missing]).strip('; ')}".rstrip(": ")
