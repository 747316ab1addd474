"""The grammar of the command line: every mistake is one clear line, and help costs nothing."""

import contextlib
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.cli import main
from pbcs_ompl.cli.arguments import build_parser, parse
from pbcs_ompl.cli.values import integer, json_object
from pbcs_ompl.core.errors import PbcsError

MISTAKES = [
    ("", "a verb is missing"),
    ("plam", "did you mean 'plan'?"),
    ("--halp", "did you mean '--help'?"),
    ("plan", "required: --env"),
    ("plan --enw pbcs/Maze-v0", "unknown option --enw; did you mean '--env'?"),
    ("plan --env pbcs/Maze-v0 --max-transition 10", "did you mean '--max-transitions'?"),
    ("plan --env pbcs/Maze-v0 surplus", "unexpected word 'surplus'"),
    ("plan --env pbcs/Maze-v0 --seed -1", "--seed: expected a whole number of at least 0, got '-1'"),
    ("plan --env pbcs/Maze-v0 --seed one", "got 'one'"),
    ("plan --env pbcs/Maze-v0 --max-transitions 0", "expected a whole number of at least 1, got '0'"),
    ("plan --env pbcs/Maze-v0 --max-transitions 1.5", "got '1.5'"),
    ("plan --env pbcs/Maze-v0 --max-seconds nan", "expected a positive number of seconds, got 'nan'"),
    ("plan --env pbcs/Maze-v0 --env-kwargs [5]", "expected a JSON object such as '{\"size\": 5}', got '[5]'"),
    ("plan --env pbcs/Maze-v0 --env-kwargs {size:5}", "got '{size:5}'"),
    ("plan --env pbcs/Maze-v0 --planner-kwargs 3", "--planner-kwargs: expected a JSON object"),
    ("train --env pbcs/Maze-v0 --method pcbs", "unknown method 'pcbs'; did you mean 'pbcs'?"),
    ("train --env pbcs/Maze-v0 --preset thesys", "did you mean 'thesis'?"),
    ("train", "--env is missing"),
    ("train --resume runs/nowhere --seed 3", "but --max-transitions from runs/nowhere; remove --seed"),
    ("train --resume runs/nowhere", "runs/nowhere/config.toml does not exist"),
    ("eval", "required: DIR"),
    ("eval runs/nowhere", "runs/nowhere"),
    ("eval runs/nowhere --epsilon 1.5", "expected a number from 0 to 1, got '1.5'"),
    ("eval runs/nowhere --episodes 0", "expected a whole number of at least 1"),
    ("compare --env pbcs/Maze-v0", "required: --planners"),
    ("compare --env pbcs/Maze-v0 --planners Ex --jobs 0", "expected a whole number of at least 1"),
    ("doctor --env-kwargs 1", "expected a JSON object"),
    ("study", "the id of a study is missing"),
    ("study deadlok", "unknown study 'deadlok'; did you mean 'deadlock'?"),
    ("study deadlock --seeds 0", "expected a whole number of at least 1"),
]


@pytest.mark.parametrize(("line", "expected"), MISTAKES)
def test_a_mistake_is_one_line_and_status_2(line, expected, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(line.split()) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("pbcs: error: ")
    assert expected in captured.err
    assert list(tmp_path.iterdir()) == []


@given(st.lists(st.text(min_size=1), max_size=5))
def test_no_words_crash_the_parser(words):
    with contextlib.suppress(PbcsError, SystemExit):
        assert parse(build_parser(), words).verb


@given(st.integers(0, 2**63))
def test_whole_numbers_are_read_exactly(number):
    assert integer(0)(str(number)) == number


def test_whole_numbers_may_be_written_with_an_exponent():
    assert integer(1)("2e5") == integer(1)("200_000") == 200_000


@given(st.dictionaries(st.text(), st.integers() | st.text() | st.booleans() | st.none()))
def test_json_objects_are_read_as_written(value):
    import json

    assert json_object(json.dumps(value)) == value


def test_help_and_version_import_nothing_heavy():
    code = ("import sys, pbcs_ompl.cli as c\n"
            "try: c.main([sys.argv[1]])\n"
            "except SystemExit: pass\n"
            "print(*sys.modules)")
    for option in ("--help", "--version"):
        run = subprocess.run([sys.executable, "-c", code, option], capture_output=True, text=True, check=True)
        imported = set(run.stdout.splitlines()[-1].split())
        assert not imported & {"numpy", "ompl", "torch", "gymnasium", "matplotlib", "rich", "numba"}


def test_a_look_at_the_installation_compiles_nothing():
    code = "import sys, pbcs_ompl.cli as c; assert c.main(['doctor']) == 0; print('numba' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "False"


def test_help_names_every_verb(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    shown = capsys.readouterr().out
    assert all(verb in shown for verb in ("doctor", "plan", "train", "eval", "compare"))
