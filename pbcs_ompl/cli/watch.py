"""`pbcs watch`: the progress of a training of another process."""

import time
from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.streams import print_error
from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.core.formatting import format_duration, format_number
from pbcs_ompl.results.files import RESULT, is_there, read_json
from pbcs_ompl.results.progress import PROGRESS, read_progress

SECONDS = 2.0


def run(arguments: Namespace) -> int:
    """Show a line whenever there is news, until the training ends; with --once or --json, the last one."""
    folder, shown = Path(arguments.dir), None
    while True:
        rows = read_progress(folder / PROGRESS)
        ended = is_there(folder / RESULT)
        summary = {**(rows[-1] if rows else {}), "left": _left(rows), "ended": ended}
        if ended or arguments.once or arguments.json:
            break
        if rows and rows[-1] != shown:
            shown = rows[-1]
            print_error(_line(summary))
        time.sleep(SECONDS)
    lines = [("now", _line(summary))] if rows else [("now", "it has just begun")]
    if ended:
        result = read_json(folder / RESULT, dict[str, Any])
        lines.append(("ended", "solved" if result.get("solved") else f"not solved: {result.get('reason')}"))
        summary["solved"] = result.get("solved")
    print_summary(summary, lines, as_json=arguments.json)
    return 0


def _left(rows: list[dict[str, Any]]) -> float | None:
    """Return the seconds that are left if the plan is covered as fast as until now; None where that is unknown."""
    covered, seconds = (rows[-1]["covered"], rows[-1]["seconds"]) if rows else (None, None)
    return seconds * (1 - covered) / covered if covered and seconds else None


def _line(summary: dict[str, Any]) -> str:
    """Return a row in words."""
    parts = [summary["phase"] or ""]
    if summary["covered"] is not None:
        parts.append(f"{summary['covered']:.0%} of the plan covered by {format_number(summary['skills'] or 0)} skills")
    if summary["success_rate"] is not None:
        parts.append(f"success {summary['success_rate']:.0%} from start point {format_number(summary['start'])}")
    parts += [f"{name.replace('_', ' ')} {format_number(summary[name])}" for name in
              ("actor_loss", "critic_loss", "transitions", "updates") if summary[name] is not None]
    if summary["left"] is not None and not summary["ended"]:
        parts.append(f"about {format_duration(summary['left'])} left")
    return ", ".join(part for part in parts if part)
