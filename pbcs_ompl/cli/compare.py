"""`pbcs compare`: planners x seeds on one environment, as a table, a picture and a Planner Arena database."""

import json
from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.pictures import draw_comparison
from pbcs_ompl.cli.terminal import Report, conclude, duration, list_files, short
from pbcs_ompl.compare.compare import compare


def run(arguments: Namespace) -> int:
    """Compare, draw, report. Returns 1 when no planner solved any run."""
    names = "-".join(arguments.planners)
    out = Path(arguments.out or fresh_folder("compare", arguments.env, names, arguments.seeds))
    try:
        with Report("compare", count="runs", budget=len(arguments.planners) * arguments.seeds) as report:
            comparison = compare(arguments.planners, arguments.env, env_kwargs=arguments.env_kwargs,
                                 seeds=arguments.seeds, max_transitions=arguments.max_transitions,
                                 jobs=arguments.jobs, out=out, on_progress=report)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"go on with the same command and --out {out}") from None
    options = f" {json.dumps(arguments.env_kwargs)}" if arguments.env_kwargs else ""
    draw_comparison(comparison, f"{arguments.env}{options}, {arguments.seeds} seeds", out)
    summary = comparison.summary()
    conclude(summary, _closing_lines(summary, out), as_json=arguments.json)
    return 0 if any(row["solved"] for row in summary["rows"]) else 1


def _closing_lines(summary: dict[str, Any], out: Path) -> list[tuple[str, str]]:
    lines = [("planner", "solved    95 % interval    transitions    seconds   (medians)")]
    lines += [(row["planner"], _cells(row)) for row in summary["rows"]]
    lines += [("", f"{row['planner']}: {row['reason']}") for row in summary["rows"] if row["reason"]]
    return [*lines, ("files", list_files(out)),
            ("next", f"plannerarena {summary['database']}   (pip install plannerarena)")]


def _cells(row: dict[str, Any]) -> str:
    share, (low, high) = f"{row['solved']}/{row['runs']}", row["wilson"]
    transitions = "-" if row["transitions_median"] is None else short(row["transitions_median"])
    seconds = "-" if row["seconds_median"] is None else duration(row["seconds_median"])
    return f"{share:<10}{f'{low:.0%} to {high:.0%}':<17}{transitions:<15}{seconds}"
