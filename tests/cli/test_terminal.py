"""What is printed: numbers for people, one JSON line for scripts."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import Report, conclude, duration, short


@pytest.mark.parametrize(("value", "text"), [(1234567, "1,234,567"), (1234.5, "1,234"), (0.12345, "0.123"),
                                              (True, "True"), ("x", "x"), (0, "0")])
def test_short(value, text):
    assert short(value) == text


@pytest.mark.parametrize(("seconds", "text"), [(0.0123, "0.012 s"), (9.99, "10 s"), (75, "1 min 15 s"),
                                                (3720, "1 h 2 min"), (59.7, "1 min 0 s")])
def test_duration(seconds, text):
    assert duration(seconds) == text


def test_json_is_the_last_line_on_stdout_and_all_there_is(capsys):
    conclude({"solved": True, "rate": np.float64(0.5)}, [("solved", "in no time")], as_json=True)
    shown = capsys.readouterr()
    assert json.loads(shown.out) == {"solved": True, "rate": 0.5}
    assert shown.out.count("\n") == 1
    assert "in no time" in shown.err


def test_a_summary_for_people_goes_to_stdout(capsys):
    conclude({"solved": True}, [("solved", "in no time")], as_json=False)
    assert capsys.readouterr().out == "solved    in no time\n"


def test_progress_without_a_terminal_is_a_line_now_and_then_with_rate_and_time_left(capsys, monkeypatch):
    clock = iter(range(0, 1000, 6))
    monkeypatch.setattr("pbcs_ompl.cli.terminal.time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    with Report("plan", budget=1000) as report:
        for count in (100, 200, 300, 400):
            report({"transitions": count, "seconds": 0.1})
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["plan: transitions 200, 16.7 transitions/s, at most 48 s left",
                     "plan: transitions 400, 16.7 transitions/s, at most 36 s left"]


def test_fresh_folder_takes_the_next_free_number(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seen = []
    for _ in range(3):
        folder = fresh_folder("plan", "pbcs/Maze-v0", "my_module:Mine", 0)
        folder.mkdir(parents=True)
        seen.append(str(folder))
    assert seen == [f"runs/plan-Maze-v0-my_module.Mine-0{end}" for end in ("", "-2", "-3")]
