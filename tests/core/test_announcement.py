"""What a first run compiles is said, and once."""

import logging
from types import SimpleNamespace

from pbcs_ompl.core import announcement


def compiled(monkeypatch, caplog, seconds):
    """Return the lines that are logged while kernels are compiled one after the other, with these durations."""
    clock = [0.0]
    monkeypatch.setattr(announcement, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    listener = announcement.CompilationListener()
    with caplog.at_level(logging.WARNING, logger="pbcs_ompl"):
        for duration in seconds:
            listener.on_start(None)
            clock[0] += duration
            listener.on_end(None)
            clock[0] += 100.0  # something else
    return [record.getMessage() for record in caplog.records]


def test_a_small_kernel_is_not_worth_a_line(monkeypatch, caplog):
    assert compiled(monkeypatch, caplog, [0.2, 0.2]) == []


def test_compilation_is_announced_and_shows_progress(monkeypatch, caplog):
    lines = compiled(monkeypatch, caplog, [0.4, 0.4, 1.0, 3.0])
    assert lines[0].startswith("compiling kernels, once")
    assert lines[1:] == ["compiled 4 kernels in 5 s"]


def test_kernels_that_a_kernel_calls_count_without_their_seconds(monkeypatch, caplog):
    listener = announcement.CompilationListener()
    clock = [0.0]
    monkeypatch.setattr(announcement, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    with caplog.at_level(logging.WARNING, logger="pbcs_ompl"):
        listener.on_start(None)
        listener.on_start(None)
        clock[0] = 1.0
        listener.on_end(None)
        clock[0] = 5.0
        listener.on_end(None)
    assert [record.getMessage() for record in caplog.records][1:] == ["compiled 2 kernels in 5 s"]
