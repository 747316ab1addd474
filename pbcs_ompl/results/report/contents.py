"""What a report says of one result folder, for each kind of folder."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from textwrap import shorten
from typing import Any

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.formatting import format_duration, format_interval, format_number, format_rate, format_seeds
from pbcs_ompl.experiments.compare import Comparison, read_comparison
from pbcs_ompl.experiments.study import study_ids
from pbcs_ompl.results.files import RUNS, read_json
from pbcs_ompl.results.folder import Folder
from pbcs_ompl.results.schema import RunOfStudy

UNFINISHED = "not finished"
MOST_RUNS = 200
"""The most rows of a table of single runs."""
COLUMNS = ("planner", "solved", "95 % interval", "transitions", "quartiles", "seconds",
           "collision checks", "path length", "coverage")
MEDIANS = ("seconds_median", "collision_checks_median", "path_length_median", "coverage_median")
NOTE = ("Medians over the seeds; in those of transitions a run that was not solved counts as if it had needed the "
        "whole budget.")


@dataclass(frozen=True)
class Table:
    """Numbers in rows.

    Attributes:
        title: One line above it.
        columns: Their names.
        rows: A value for each column: words, numbers, None for nothing.
        note: What a reader has to know beside it.
        folded: Show the title alone until it is opened.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    note: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Content:
    """What a plan, a training, an evaluation, a comparison or a study found.

    Attributes:
        title: What was run, in one line.
        outcome: The result in a few words.
        good: Whether it is a success; None when it is not finished, or neither.
        summary: Names and values of the main numbers.
        seeds: The seeds, in words.
        claims: Claims of a study, as `Claim.to_dict` returns them.
        tables: Numbers.
        failures: What failed, and why.
    """

    title: str
    outcome: str
    good: bool | None
    summary: list[tuple[str, str]]
    seeds: str = ""
    claims: list[dict[str, Any]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    failures: list[tuple[str, str]] = field(default_factory=list)


def read_content(folder: Folder) -> Content:
    """Return what a folder holds.

    Raises:
        DamagedFile: a record in it is damaged.
    """
    readers: dict[str, Callable[[Folder], Content]] = {
        "plan": _plan, "train": _training, "eval": _evaluation, "compare": _comparison, "study": _study,
        "follower": _follower, "distill": _distillation}
    return readers[folder.kind](folder)


def _plan(folder: Folder) -> Content:
    config, result = folder.config, folder.result
    title, seeds = f"{config['planner']} in {_environment(config)}", str(config["seed"])
    if result is None:
        return Content(title, UNFINISHED, None, [], seeds)
    summary = [("transitions", format_number(result["transitions"])), ("seconds", format_duration(result["seconds"])),
               ("nodes", format_number(result["nodes"]))]
    if not result["solved"]:
        return Content(title, "not solved", False, summary, seeds,
                       failures=[("not solved", "the budget ended before the goal was reached")])
    replay = "replays exactly" if result["replay_ok"] else "does not replay"
    return Content(title, f"solved, {replay}", bool(result["replay_ok"]),
                   [("path", f"{format_number(result['path_length'])} steps"), *summary], seeds)


def _training(folder: Folder) -> Content:
    config, result = folder.config, folder.result
    title = f"{config['method']} with {config['agent']} in {_environment(config)}"
    if result is None:
        return Content(title, UNFINISHED, None, [], str(config["seed"]))
    summary = [("skills", str(result["skills"])),
               ("transitions of planning", format_number(result["plan_transitions"])),
               ("transitions of training", format_number(result["train_transitions"])),
               ("updates", format_number(result["updates"])), ("time", format_duration(result["seconds"]))]
    if result["wilson"] is not None:
        summary.insert(0, ("success with 10 % random actions", format_rate(result["success_rate"], result["wilson"])))
    reason = result["reason"]
    return Content(title, "solved" if result["solved"] else "not solved", result["solved"], summary,
                   str(config["seed"]), failures=[] if result["solved"] else [("not solved", reason)])


def _follower(folder: Folder) -> Content:
    config, result = folder.config, folder.result
    title = f"A follower of random lines in {len(config['worlds'])} worlds of {_environment(config)}"
    if result is None:
        return Content(title, UNFINISHED, None, [], str(config["seed"]))
    return Content(title, f"{result['test_rate']:.0%} of the test lines", None,
                   [("test lines without noise", f"{result['test_rate']:.0%}"),
                    ("transitions", format_number(result["transitions"])),
                    ("updates", format_number(result["updates"])), ("time", format_duration(result["seconds"]))],
                   str(config["seed"]))


def _distillation(folder: Folder) -> Content:
    config, result = folder.config, folder.result
    title = f"One network in place of {config['chain'] or 'a chain'} in {_environment(config)}"
    if result is None:
        return Content(title, UNFINISHED, None, [], str(config["seed"]))
    return Content(title, "solved" if result["solved"] else "not solved", result["solved"],
                   [("student, with 10 % random actions", format_rate(result["success_rate"], result["wilson"])),
                    ("teacher", format_rate(result["teacher_success_rate"], result["teacher_wilson"])),
                    ("rounds", format_number(result["rounds"])), ("transitions", format_number(result["transitions"])),
                    ("updates", format_number(result["updates"])), ("time", format_duration(result["seconds"]))],
                   str(config["seed"]))


def _evaluation(folder: Folder) -> Content:
    config, result = folder.config, folder.result
    title = f"Evaluation of {config['chain']} in {_environment(config)}"
    if result is None:
        return Content(title, UNFINISHED, None, [])
    rate = format_rate(result["success_rate"], result["wilson"])
    steps = "no success" if result["steps_median"] is None else format_number(result["steps_median"])
    return Content(title, f"{result['success_rate']:.0%} success", result["success_rate"] > 0,
                   [("success", rate), ("episodes", format_number(result["episodes"])), ("steps, median", steps),
                    ("random actions", f"{result['epsilon']:.0%}")])


def _comparison(folder: Folder) -> Content:
    """Return the content of a comparison, from its records."""
    config, found = folder.config, read_comparison(folder.path)
    solved, runs = sum(row["solved"] for row in found.rows), len(found.runs)
    wanted = len(config["planners"]) * len(config["environments"]) * len(config["seeds"])
    ended = runs == wanted and folder.result is not None
    outcome = f"{solved:,} of {runs:,} runs solved" + ("" if ended else f"; {runs:,} of {wanted:,} runs made")
    outlines = [{name: value for name, value in _outline(run).items() if name not in ("planner", "seed")}
                for run in found.runs]  # the name of a run has both
    return Content(f"{', '.join(config['planners'])} compared", outcome, None,
                   [("runs", f"{runs:,}"), ("budget of a run", f"{config['max_transitions']:,} transitions")],
                   format_seeds(config["seeds"]),
                   tables=[*_rows(found), *_tests(found), _table_of_runs(outlines, folder.path / RUNS)],
                   failures=_failures(found))


def _rows(found: Comparison) -> list[Table]:
    """Return a table for each environment."""
    return [Table(environment, COLUMNS, [_row(row) for row in rows], NOTE)
            for environment, rows in groupby(found.rows, key=itemgetter("environment"))]


def _row(row: dict[str, Any]) -> list[Any]:
    quartiles = row["transitions_quartiles"]
    return [row["planner"], f"{row['solved']}/{row['runs']}", format_interval(*row["wilson"]),
            row["transitions_median"],
            None if quartiles is None else " to ".join(f"{value:,.0f}" for value in quartiles),
            *(row[name] for name in MEDIANS)]


def _tests(found: Comparison) -> list[Table]:
    rows = [[test["environment"], *test["planners"], *test["fewer"], test["ties"], f"{test['p']:.2g}",
             f"{test['p_holm']:.2g}"] for test in found.tests]
    columns = ("environment", "planner A", "planner B", "A needs less", "B needs less", "ties", "p uncorrected",
               "p (Holm)")
    return [Table("Number of seeds in which either of two planners needs fewer transitions (sign tests)", columns,
                  rows, folded=True)] if rows else []


def _failures(found: Comparison) -> list[tuple[str, str]]:
    """Return the reasons of the failed runs, each once with the seeds that have it."""
    seeds: dict[tuple[str, str, str], list[int]] = defaultdict(list)
    for environment, planners in found.by_environment().items():
        for planner, runs in planners.items():
            for run in runs:
                if run["seconds"] is None:
                    seeds[environment, planner, run["reason"]].append(run["seed"])
    return [(f"{planner} in {environment}, seeds {format_seeds(those)}", reason)
            for (environment, planner, reason), those in seeds.items()]


def _study(folder: Folder) -> Content:
    files = sorted((folder.path / RUNS).glob("*.json"))
    seeds: set[int] = set()
    outlines = []
    for file in files:
        record = read_json(file, RunOfStudy, finite=False)
        seeds.update([record["seed"]] if isinstance(record.get("seed"), int) else record.get("seeds", []))
        outlines.append(_outline({"run": file.stem} | record))
    study, result = folder.config["study"], folder.result
    title = ": ".join(filter(None, [f"Study {study}", study_ids().get(study)]))
    tables, words = [_table_of_runs(outlines, folder.path / RUNS)], format_seeds(seeds)
    if result is None:
        return Content(title, f"{UNFINISHED}; {len(files):,} runs made", None, [], words, tables=tables)
    failed = result["failed"]
    return Content(title, _verdict([claim["agrees"] for claim in result["agrees"]]), None,
                   [("runs", f"{result['runs']:,}"), ("failed runs", f"{len(failed):,}")], words,
                   claims=result["agrees"], tables=tables, failures=list(failed.items()))


def _verdict(agrees: list[bool | None]) -> str:
    undecided = f", {agrees.count(None)} undecided" if None in agrees else ""
    return f"{agrees.count(True)} of {len(agrees)} claims true, {agrees.count(False)} false{undecided}"


def _environment(config: dict[str, Any]) -> str:
    """Return the label of an environment for a title; the settings have it in full."""
    return shorten(EnvSpec.from_dict(config["environment"]).label, 100, placeholder=" ...")


def _outline(record: dict[str, Any]) -> dict[str, Any]:
    """Return the words and numbers of a record, without its lists and tables."""
    return {name: value for name, value in record.items() if not isinstance(value, list | dict)}


def _table_of_runs(outlines: Sequence[dict[str, Any]], folder: Path) -> Table:
    """Return a folded table of runs, the first ones if there are many; `folder` holds them all."""
    shown = outlines[:MOST_RUNS]
    columns = list(dict.fromkeys(name for outline in shown for name in outline))
    total = f"{len(outlines):,}"
    note = f"The first {MOST_RUNS} of {total} runs; {folder}/ holds them all." if len(outlines) > MOST_RUNS else ""
    return Table(f"Every run ({total})", columns, [[outline.get(name) for name in columns] for outline in shown], note,
                 folded=True)
