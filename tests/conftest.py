import os
import signal
from collections import Counter

import pytest

os.environ.setdefault("OMP_NUM_THREADS", "1")
"""Torch's threads, in this process and all that it starts: where workers share cores, more of them wait for each other,
and steps of small networks take thirty times as long."""
pytest_plugins = ["pytester"]


def pytest_configure() -> None:
    """Hear Ctrl-C: a pytest that a shell has started in the background ignores it, and so would what we interrupt."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show where the time was spent: the seconds of the slowest modules."""
    seconds: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if isinstance(report, pytest.TestReport):
                seconds[report.location[0]] += report.duration
    if sum(seconds.values()) > 60.0:
        terminalreporter.section("slowest modules")
        for module, spent in seconds.most_common(10):
            terminalreporter.line(f"{spent:7.1f} s  {module}")
