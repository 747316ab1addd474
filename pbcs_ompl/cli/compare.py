"""`pbcs compare`: planners x environments x seeds, as a table, pictures and a Planner Arena database."""

from argparse import Namespace
from itertools import groupby
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.executor import executor
from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.pictures import draw_comparison
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary
from pbcs_ompl.core.errors import InvalidOption, did_you_mean
from pbcs_ompl.core.formatting import format_duration, format_number
from pbcs_ompl.core.signals import with_remedy
from pbcs_ompl.experiments.compare import compare
from pbcs_ompl.results.command_line import command, report_words, shell

HEADER = f"{'solved':<10}{'95 % interval':<17}{'transitions':<15}{'seconds':<10}(medians)"


def run(arguments: Namespace) -> int:
    """Compare, draw, report. Returns 1 when no planner solved any run."""
    planners = _with_options(arguments.planners, arguments.planner_kwargs)
    out = Path(arguments.out or fresh_folder("compare", *_names(arguments), arguments.seeds))
    budget = len(planners) * max(len(arguments.env), len(arguments.env_kwargs)) * arguments.seeds
    try:
        with executor(arguments) as jobs, ProgressDisplay("compare", count="runs", budget=budget) as display:
            comparison = compare(planners, arguments.env, env_kwargs=arguments.env_kwargs, goal=arguments.goal,
                                 feature=arguments.feature, start_seed=arguments.start_seed,
                                 reset_options=arguments.reset_options, seeds=arguments.seeds,
                                 max_transitions=arguments.max_transitions, max_seconds=arguments.max_seconds,
                                 max_memory=arguments.max_memory, improve=arguments.improve, jobs=jobs, out=out,
                                 on_progress=display)
    except KeyboardInterrupt as error:
        raise with_remedy(error, f"continue with the same command and --out {shell(str(out))}") from None
    draw_comparison(comparison, f"{arguments.seeds} seeds", out)
    summary = comparison.summary()
    print_summary(summary, _closing_lines(summary, out), as_json=arguments.json)
    return 0 if any(row["solved"] for row in summary["rows"]) else 1


def _with_options(planners: list[str], options: dict[str, Any]) -> dict[str, Any]:
    """Return the planners with their options."""
    if len(set(planners)) < len(planners):
        raise InvalidOption(f"planners holds something twice: {planners}")
    for name, chosen in options.items():
        if name not in planners:
            raise InvalidOption(f"options for {name!r}, which is not compared{did_you_mean(name, planners)}")
        if not isinstance(chosen, dict):
            raise InvalidOption(f"options for {name!r} are {chosen!r}; expected an object as {{\"bin_size\": 0.2}}")
    return {name: options.get(name, {}) for name in planners}


def _names(arguments: Namespace) -> list[str]:
    """Return what the folder is called after: the first environment and the planners."""
    others = max(len(arguments.env), len(arguments.env_kwargs)) - 1
    return [arguments.env[0], *([f"and-{others}-more"] if others else []), "-".join(arguments.planners)]


def _closing_lines(summary: dict[str, Any], out: Path) -> list[tuple[str, str]]:
    lines = []
    for place, rows in groupby(summary["rows"], key=lambda row: row["environment"]):
        chosen = list(rows)
        lines += [("in", place), ("planner", HEADER), *((row["planner"], _cells(row)) for row in chosen)]
        lines += [("", _failure(row)) for row in chosen if row["failed"]]
        lines += [("pair", _pair(test)) for test in summary["tests"] if test["environment"] == place]
    return [*lines, ("files", list_files(out)),
            ("next", command(report_words(out))),
            ("", f"DATABASE={shell(str(summary['database']))} plannerarena   (pip install 'pbcs-ompl[arena]')")]


def _cells(row: dict[str, Any]) -> str:
    share, (low, high) = f"{row['solved']}/{row['runs']}", row["wilson"]
    transitions = "-" if row["transitions_median"] is None else format_number(row["transitions_median"])
    seconds = "-" if row["seconds_median"] is None else format_duration(row["seconds_median"])
    return f"{share:<10}{f'{low:.0%} to {high:.0%}':<17}{transitions:<15}{seconds}"


def _failure(row: dict[str, Any]) -> str:
    return f"{row['planner']}: {row['failed']} of {row['runs']} runs failed; {row['reason']}"


def _pair(test: dict[str, Any]) -> str:
    """Say in how many seeds which of two planners needed fewer transitions."""
    (first, second), (wins, losses) = test["planners"], test["fewer"]
    if losses > wins:
        first, second, wins, losses = second, first, losses, wins
    ties = f" and {test['ties']} ties" if test["ties"] else ""
    chance = f"p (Holm) = {test['p_holm']:.2g}, sign test"
    return f"{first} needs less than {second} in {wins} seeds, more in {losses}{ties}: {chance}"
