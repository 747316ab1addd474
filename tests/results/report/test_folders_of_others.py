"""A bad folder among good ones costs only its own section; no link out of a folder is followed; nothing waits."""

import json
import os

import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.results.report import write_report


@pytest.fixture
def copy(laboratory, tmp_path, monkeypatch):
    """A copy of the laboratory, in which a test may do what it likes."""
    import shutil

    shutil.copytree(laboratory, tmp_path / "copy")
    monkeypatch.chdir(tmp_path / "copy")
    return tmp_path / "copy"


def replaced(make):
    def change(path):
        path.unlink()
        make(path)

    return change


BAD = {
    "a pipe": ("plan/tree.png", replaced(os.mkfifo)),
    "a pipe of JSON": ("plan/result.json", replaced(os.mkfifo)),
    "a pipe of TOML": ("plan/config.toml", replaced(os.mkfifo)),
    "a folder": ("plan/tree.png", replaced(lambda path: path.mkdir())),
    "a dangling link": ("plan/tree.png", replaced(lambda path: path.symlink_to("nothing"))),
    "a link out": ("plan/tree.png", replaced(lambda path: path.symlink_to("/etc/hostname"))),
    "a link out of JSON": ("plan/provenance.json", replaced(lambda path: path.symlink_to("/etc/hostname"))),
    "a loop": ("plan/tree.png", replaced(lambda path: path.symlink_to(path.name))),
    "deep": ("plan/result.json", lambda path: path.write_text("[" * 100_000)),
    "deep TOML": ("plan/config.toml", lambda path: path.write_text("a = " + "[" * 100_000)),
    "too large": ("plan/result.json", lambda path: edit(path, transitions="@", text=("\"@\"", "1e400"))),
    "no number": ("plan/result.json", lambda path: edit(path, seconds=float("nan"))),
    "long number": ("plan/result.json", lambda path: edit(path, seconds="@", text=("\"@\"", "1" * 5000))),
    "half a character": ("plan/result.json", lambda path: path.write_text('{"a": "\\ud800"}')),
    "claims": ("study/result.json", lambda path: edit(path, agrees=[{"claim": 5, "agrees": "x"}])),
}


def edit(path, text=("", ""), **changes):
    path.write_text(json.dumps(json.loads(path.read_text()) | changes).replace(*text))


@pytest.mark.timeout(60)
@pytest.mark.parametrize("case", BAD)
def test_a_bad_folder_costs_only_its_own_section(copy, case):
    file, change = BAD[case]
    change(copy / "runs" / file)
    name = file.partition("/")[0]
    _, sections = write_report("runs")
    assert [section.name for section in sections if section.kind == "damaged"] == [name]
    assert len(sections) == 6
    secret = os.uname().nodename
    assert secret not in (copy / "runs/report.html").read_text().split()


def test_what_was_changed_later_is_shown_with_a_note(copy, capsys):
    edit(copy / "runs/plan/result.json", transitions=7)
    assert main(["report", "runs/plan"]) == 0
    page = (copy / "runs/plan/report.html").read_text()
    assert "was changed or removed after it was written" in page


def test_names_of_folders_do_not_reach_the_terminal(copy, capsys):
    (copy / "runs/plan").rename(copy / "runs/\x1b[31mred\n")
    assert main(["report", "runs"]) == 0
    assert "\x1b" not in capsys.readouterr().out


def test_the_page_is_not_written_into_a_pipe(copy, capsys):
    os.mkfifo(copy / "runs/report.html")
    assert main(["report", "runs"]) == 2
    assert "no regular file" in capsys.readouterr().err
