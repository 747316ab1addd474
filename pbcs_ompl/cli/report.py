"""`pbcs report`: result folders as one page."""

from argparse import Namespace
from typing import Any

from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.results.report import write_report


def run(arguments: Namespace) -> int:
    """Write the page; say where it is and what it shows."""
    page, sections = write_report(arguments.dir, arguments.out)
    folders: list[dict[str, Any]] = [{"folder": section.name, "kind": section.kind, "outcome": section.content.outcome}
                                     for section in sections]
    failures = [(section.name, reason) for section in sections for _, reason in section.content.failures
                if section.kind == "damaged"]
    lines = [(folder["kind"], f"{folder['folder']}: {folder['outcome']}") for folder in folders]
    print_summary({"out": str(page), "folders": folders, "damaged": dict(failures)},
             [*lines, *(("damaged", reason) for _, reason in failures), ("page", str(page))], as_json=arguments.json)
    return 0
