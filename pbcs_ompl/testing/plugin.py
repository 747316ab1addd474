"""The pytest plug-in: the fixture `solve_rate`, and a table of all solve rates at the end of the test run.

A test that measures in another way records its rate itself:
`record_property("solve_rate", [who, where, solved, runs])`. Under pytest-xdist the properties come back to the main
process with the reports.
"""

from collections.abc import Callable, Iterator
from typing import Any

import pytest


@pytest.fixture
def solve_rate(record_property: Callable[[str, object], None]) -> Callable[..., Any]:
    """Return `pbcs_ompl.testing.assert_solves`, whose rates also go into the closing table."""
    # loads OMPL, which other people's tests do not need
    from pbcs_ompl.testing.solve_rate import SolveRate, TooFewSolved, assert_solves

    def record(rate: SolveRate, where: Any) -> None:
        record_property("solve_rate", [rate.planner, where or rate.env, rate.solved, len(rate.seeds)])

    def checked(planner: Any, env: str, env_kwargs: dict[str, Any] | None = None, *, where: Any = None,
                **options: Any) -> Any:
        __tracebackhide__ = True
        try:
            rate = assert_solves(planner, env, env_kwargs, **options)
        except TooFewSolved as failed:
            record(failed.rate, where)
            raise
        record(rate, where)
        return rate

    return checked


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> Iterator[None]:
    """Let everybody else write first, then print the table."""
    yield
    reports = [report for kind in ("passed", "failed") for report in terminalreporter.stats.get(kind, [])]
    rates = [value for report in reports for name, value in report.user_properties if name == "solve_rate"]
    if rates:
        terminalreporter.section("solve rates, with 95 % Wilson intervals")
        for line in rate_table(rates):
            terminalreporter.line(line)


def rate_table(rates: list[list[Any]]) -> list[str]:
    """Return the lines of a table, one row for each `who` and one column for each `where`."""
    from pbcs_ompl.core.statistics import wilson  # loads scipy

    cells = {}
    for who, where, solved, runs in rates:
        low, high = wilson(solved, runs)
        cells[who, where] = f"{solved}/{runs} [{low:.0%}, {high:.0%}]"
    places = sorted({where for _, where in cells}, key=lambda where: (len(str(where)), str(where)))
    rows = [["", *(str(where) for where in places)]]
    rows += [[who, *(cells.get((who, where), "") for where in places)] for who in sorted({who for who, _ in cells})]
    widths = [max(len(row[column]) for row in rows) + 3 for column in range(len(places) + 1)]
    return ["".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
