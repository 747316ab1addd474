"""`pbcs report`: result folders as one page."""

from argparse import Namespace

from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.results.report import write_report


def run(arguments: Namespace) -> int:
    """Write the page; say where it is and what it shows."""
    summary = write_report(arguments.dir, arguments.out).summary()
    lines = [(folder["kind"], f"{folder['folder']}: {folder['outcome']}") for folder in summary["folders"]]
    damaged = [("damaged", reason) for reason in summary["damaged"].values()]
    print_summary(summary, [*lines, *damaged, ("page", summary["out"])], as_json=arguments.json)
    return 0
