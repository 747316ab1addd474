"""`pbcs study`: run an experiment, draw its figures, say which of its claims the data agree with."""

import shlex
import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.executor import executor
from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import in_words
from pbcs_ompl.experiments.run_study import run_shard, run_study
from pbcs_ompl.experiments.study import Study, find_study, study_ids
from pbcs_ompl.experiments.run_study import open_study
from pbcs_ompl.experiments.study.runs import record_name, run_settings
from pbcs_ompl.experiments.run import Shard
from pbcs_ompl.experiments.workers.schedulers import makefile, slurm_script
from pbcs_ompl.results.files import write_text

VERDICTS = {True: "agrees", False: "DIFFERS", None: "no data"}


def run(arguments: Namespace) -> int:
    """Run, analyse, report. Returns 1 when a run failed; claims that are false are an answer, not a failure."""
    if arguments.list:
        titles = study_ids()
        print_summary({"studies": titles}, list(titles.items()), as_json=arguments.json)
        return 0
    if arguments.id is None:
        raise InvalidOption("the id of a study is missing; pbcs study --list shows them all")
    if arguments.shard is not None and (arguments.emit or not arguments.out):
        raise InvalidOption("--shard makes runs in the --out that all shards share: add --out, leave out --emit")
    study = find_study(arguments.id)
    study = study if arguments.device is None else study.on_device(arguments.device)
    arguments.seeds = study.seeds if arguments.seeds is None else arguments.seeds
    out = Path(arguments.out or fresh_folder("study", study.id, arguments.seeds))
    if arguments.emit:
        return _emit(study, arguments, out)
    try:
        return _make(study, arguments, out)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"continue with the same command and --out {out}") from None


def _make(study: Study, arguments: Namespace, out: Path) -> int:
    """Make the runs, all of them or those of a shard, and say what came of them."""
    settings = run_settings(study, arguments.seeds)
    shard = None if arguments.shard is None else Shard(*arguments.shard)
    budget = len(settings if shard is None else shard.of(settings))
    with executor(arguments) as jobs, ProgressDisplay(study.id, count="runs", budget=budget) as display:
        options = {"out": out, "seeds": arguments.seeds, "jobs": jobs, "max_seconds": arguments.max_seconds,
                   "max_memory": arguments.max_memory, "on_progress": display}
        if shard is None:
            result = run_study(study, **options)
            summary, failed = result.summary(), result.failed
            lines = _closing_lines(study.title, summary, out)
        else:
            records, failed = run_shard(study, shard, **options)
            summary = {"id": study.id, "shard": str(shard), "runs": len(records), "failed": failed,
                       "out": str(out)}
            lines = [(study.id, f"shard {shard}: {len(records)} of {budget} runs"), *_failures(failed),
                     ("next", "the other shards, then the same command without --shard")]
    print_summary(summary, lines, as_json=arguments.json)
    return 1 if failed else 0


def _emit(study: Study, arguments: Namespace, out: Path) -> int:
    """Write the runs for a scheduler."""
    limits = [("--max-seconds", arguments.max_seconds), ("--max-memory", arguments.max_memory)]
    device = [] if arguments.device is None else ["--device", arguments.device]
    command = [sys.executable, "-m", "pbcs_ompl.cli", "study", str(study.folder.resolve()),
               "--seeds", str(arguments.seeds), "--out", str(out.resolve()), *device,
               *(word for option, limit in limits if limit is not None for word in (option, f"{limit:g}"))]
    settings = run_settings(study, arguments.seeds)
    with open_study(study, out, arguments.seeds):
        if arguments.emit == "make":
            file, following = out / "Makefile", f"make -C {out} --jobs 2 --keep-going"
            write_text(file, makefile(command, [record_name(one) for one in settings]))
        else:
            file, following = out / "slurm.sh", f"sbatch {out / 'slurm.sh'}"
            write_text(file, slurm_script(command, len(settings), study.id, out.resolve()))
    print_summary({"id": study.id, "runs": len(settings), "out": str(out), "file": str(file)},
             [(study.id, f"{len(settings)} runs in {file}"), ("next", following)], as_json=arguments.json)
    return 0


def _failures(failed: dict[str, str]) -> list[tuple[str, str]]:
    return [("failed", f"{name}: {reason}") for name, reason in failed.items()]


def _closing_lines(title: str, summary: dict[str, Any], out: Path) -> list[tuple[str, str]]:
    lines = [(summary["id"], f"{title}: {summary['runs']} runs")]
    for claim in summary["agrees"]:
        lines.append((VERDICTS[claim["agrees"]], f"{claim['claim']}  ({claim['source']})"))
        lines += [("", f"{name}: {in_words(value)}") for name, value in claim["numbers"].items()]
        lines += [("", claim["note"])] if claim["note"] else []
    lines += _failures(summary["failed"])
    return [*lines, ("figures", ", ".join(summary["figures"]) or "none"), ("files", list_files(out)),
            ("next", f"pbcs report {shlex.quote(str(out))}")]
