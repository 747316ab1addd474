"""What a report says of a comparison of planners."""

from collections import defaultdict
from itertools import groupby
from operator import itemgetter
from typing import Any

from pbcs_ompl.core.formatting import seeds_in_words, span
from pbcs_ompl.experiments.compare import Comparison, read_comparison
from pbcs_ompl.experiments.compare.records import RUNS
from pbcs_ompl.results.report.content import Content, Table, outline, table_of_runs
from pbcs_ompl.results.report.folder import Folder

COLUMNS = ("planner", "solved", "95 % interval", "transitions", "quartiles", "seconds",
           "collision checks", "path length", "coverage")
NOTE = ("Medians over the seeds; in those of transitions a run that was not solved counts as if it had needed the "
        "whole budget.")
MEDIANS = ("seconds_median", "collision_checks_median", "path_length_median", "coverage_median")


def comparison_content(folder: Folder) -> Content:
    """Return what the folder of `pbcs compare` holds, merged anew from the records.

    Raises:
        DamagedFile: a record is damaged.
    """
    config, found = folder.config, read_comparison(folder.path)
    solved, runs = sum(row["solved"] for row in found.rows), len(found.runs)
    wanted = len(config["planners"]) * len(config["environments"]) * len(config["seeds"])
    ended = runs == wanted and folder.result is not None
    outcome = f"{solved:,} of {runs:,} runs solved" + ("" if ended else f"; {runs:,} of {wanted:,} runs made")
    records = table_of_runs([_outline(run) for run in found.runs], folder.path / RUNS)
    return Content(f"{', '.join(config['planners'])} compared", outcome, None,
                   [("runs", f"{runs:,}"), ("budget of a run", f"{config['max_transitions']:,} transitions")],
                   seeds_in_words(config["seeds"]), tables=[*_rows(found), *_tests(found), records],
                   failures=_failures(found))


def _rows(found: Comparison) -> list[Table]:
    """Return a table for each environment."""
    return [Table(environment, COLUMNS, [_row(row) for row in rows], NOTE)
            for environment, rows in groupby(found.rows, key=itemgetter("environment"))]


def _row(row: dict[str, Any]) -> list[Any]:
    return [row["planner"], f"{row['solved']}/{row['runs']}", span(*row["wilson"]), row["transitions_median"],
            _quartiles(row["transitions_quartiles"]), *(row[name] for name in MEDIANS)]


def _quartiles(values: list[float] | None) -> str | None:
    return None if values is None else " to ".join(f"{value:,.0f}" for value in values)


def _tests(found: Comparison) -> list[Table]:
    rows = [[test["environment"], *test["planners"], *test["fewer"], test["ties"], f"{test['p']:.2g}",
             f"{test['p_holm']:.2g}"] for test in found.tests]
    columns = ("environment", "planner A", "planner B", "A needs less", "B needs less", "ties", "p", "p (Holm)")
    return [Table("In how many seeds which of two planners needs fewer transitions (sign tests)", columns,
                  rows, folded=True)] if rows else []


def _failures(found: Comparison) -> list[tuple[str, str]]:
    """Return the reasons of the runs that did not come to an end, each once with the seeds that have it."""
    seeds: dict[tuple[str, str, str], list[int]] = defaultdict(list)
    for environment, planners in found.by_environment().items():
        for planner, runs in planners.items():
            for run in runs:
                if run["seconds"] is None:
                    seeds[environment, planner, run["reason"]].append(run["seed"])
    return [(f"{planner} in {environment}, seeds {seeds_in_words(those)}", reason)
            for (environment, planner, reason), those in seeds.items()]


def _outline(run: dict[str, Any]) -> dict[str, Any]:
    """Return the words and numbers of a record, without what its name says already."""
    return {name: value for name, value in outline(run).items() if name not in ("planner", "seed", "env")}
