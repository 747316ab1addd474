"""What is printed: numbers for people, one JSON line for scripts."""

import io
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import ProgressDisplay, print_summary
from pbcs_ompl.core.formatting import format_duration, format_number


@pytest.mark.parametrize(("value", "text"), [(1234567, "1,234,567"), (1234.5, "1,234"), (0.12345, "0.123"),
                                              (True, "True"), ("x", "x"), (0, "0")])
def test_short(value, text):
    assert format_number(value) == text


@pytest.mark.parametrize(("seconds", "text"), [(0.0123, "0.012 s"), (9.99, "10 s"), (75, "1 min 15 s"),
                                                (3720, "1 h 2 min"), (59.7, "1 min 0 s")])
def test_duration(seconds, text):
    assert format_duration(seconds) == text


def test_json_is_the_last_line_on_stdout_and_all_there_is(capsys):
    print_summary({"solved": True, "rate": np.float64(0.5)}, [("solved", "in no time")], as_json=True)
    shown = capsys.readouterr()
    assert json.loads(shown.out) == {"solved": True, "rate": 0.5}
    assert shown.out.count("\n") == 1
    assert "in no time" in shown.err


def test_a_summary_for_people_goes_to_stdout(capsys):
    print_summary({"solved": True}, [("solved", "in no time")], as_json=False)
    assert capsys.readouterr().out == "solved    in no time\n"
    print_summary({}, [("planner", "solved"), ("my_module:Newest", "5/5")], as_json=False)
    assert capsys.readouterr().out == "planner          solved\nmy_module:Newest 5/5\n"


def test_progress_without_a_terminal_is_a_line_now_and_then_with_rate_and_time_left(capsys, monkeypatch):
    clock = iter(range(0, 1000, 6))
    monkeypatch.setattr("pbcs_ompl.cli.terminal.time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    with ProgressDisplay("plan", budget=1000) as display:
        for count in (100, 200, 300, 400):
            display({"transitions": count, "seconds": 0.1})
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["plan: transitions 200, 16.7 transitions/s, at most 48 s left",
                     "plan: transitions 400, 16.7 transitions/s, at most 36 s left"]


def test_what_was_there_at_once_counts_neither_for_the_rate_nor_for_the_time_left(capsys, monkeypatch):
    clock = iter([0.0, 0.5, 20.5])
    monkeypatch.setattr("pbcs_ompl.cli.terminal.time", SimpleNamespace(monotonic=lambda: next(clock)))
    with ProgressDisplay("study", count="runs", budget=100) as display:
        for count in (80, 82):
            display({"runs": count})
    assert capsys.readouterr().err == "study: runs 82, 0.0976 runs/s, at most 3 min 5 s left\n"


TABLE = [{"planner": "Ex", "runs": "3/4", "median": 1234.5}, {"planner": "RRT", "runs": "0/4", "median": "-"}]


def test_a_table_without_a_terminal_is_a_line_for_each_row(capsys, monkeypatch):
    clock = iter(range(0, 1000, 20))
    monkeypatch.setattr("pbcs_ompl.cli.terminal.time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    with ProgressDisplay("compare", count="runs", budget=8) as display:
        display({"runs": 3, "table": TABLE})
    assert capsys.readouterr().err.splitlines() == [
        "compare: runs 3, 0.15 runs/s, at most 33 s left", "  planner Ex, runs 3/4, median 1,234",
        "  planner RRT, runs 0/4, median -"]


def test_a_table_on_a_terminal_stands_under_the_bar(monkeypatch):
    screen = Console(file=io.StringIO(), force_terminal=True, no_color=True, width=100)
    monkeypatch.setattr("pbcs_ompl.cli.bar.Console", lambda **_: screen)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with ProgressDisplay("compare", count="runs", budget=8) as display:
        display({"runs": 3, "table": TABLE})
    plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", screen.file.getvalue())
    shown = [line.split() for line in plain.splitlines()]
    assert ["planner", "runs", "median"] in shown
    assert ["Ex", "3/4", "1,234"] in shown
    assert ["RRT", "0/4", "-"] in shown


def test_fresh_folder_takes_the_next_free_number(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seen = []
    for _ in range(3):
        folder = fresh_folder("plan", "pbcs/Maze-v0", "my_module:Mine", 0)
        folder.mkdir(parents=True)
        seen.append(str(folder))
    assert seen == [f"runs/plan-Maze-v0-my_module.Mine-0{end}" for end in ("", "-2", "-3")]
