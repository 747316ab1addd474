"""A table of maze solve rates as the last words of a test run.

A test of tests/mazes/ states what it measured: `record_property("solve_rate", [who, size, solved, runs])`.
Under pytest-xdist the properties come back to the main process with the reports.
"""

import os
from collections.abc import Iterator

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch is imported; the workers share the cores

import pytest
from scipy.stats import binomtest


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Iterator[None]:
    """Let everybody else write first, then print the table."""
    yield
    reports = [report for kind in ("passed", "failed") for report in terminalreporter.stats.get(kind, [])]
    rates = [value for report in reports for name, value in report.user_properties if name == "solve_rate"]
    if rates:
        terminalreporter.section("maze solve rates, with 95 % Wilson intervals")
        for line in rate_table(rates):
            terminalreporter.line(line)


def rate_table(rates: list[list]) -> list[str]:
    """Return the lines of a table, one row for each `who` and one column for each maze size."""
    cells = {(who, size): f"{solved}/{runs} {_interval(solved, runs)}" for who, size, solved, runs in rates}
    sizes = sorted({size for _, size in cells})
    rows = [["", *(f"{size}x{size}" for size in sizes)]]
    for name in sorted({who for who, _ in cells}):
        rows.append([name, *(cells.get((name, size), "") for size in sizes)])
    return ["".join(f"{cell:<20}" for cell in row).rstrip() for row in rows]


def _interval(solved: int, runs: int) -> str:
    interval = binomtest(solved, runs).proportion_ci(method="wilson")
    return f"[{interval.low:.0%}, {interval.high:.0%}]"
