"""A report shows everything a folder holds, needs nothing but itself, and overwrites nothing that is not its own."""

import json
import shutil
from html.parser import HTMLParser

import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import DamagedFile, RunFolderError
from pbcs_ompl.core.formatting import format_seeds, format_value
from pbcs_ompl.experiments.claims import rate
from pbcs_ompl.results.files import write_json, write_toml
from pbcs_ompl.results.report import write_report
from pbcs_ompl.results.report.contents import MOST_RUNS

REFERENCES = {"src", "href", "srcset", "data", "action", "poster", "background"}


class Page(HTMLParser):
    """The text of a page, its tags, and everything it refers to."""

    def __init__(self, path):
        super().__init__()
        self.text, self.tags, self.references = "", [], []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.references += [value for name, value in attrs if name in REFERENCES]

    def handle_data(self, data):
        self.text += data


@pytest.fixture
def copy(laboratory, tmp_path, monkeypatch):
    """The laboratory again, to be changed."""
    monkeypatch.chdir(shutil.copytree(laboratory, tmp_path / "copy"))
    return tmp_path / "copy"


def test_the_verb_reports_every_folder(copy, capsys):
    assert main(["report", "runs", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["out"] == "runs/report.html"
    outcomes = {one["folder"]: (one["kind"], one["outcome"]) for one in answer["folders"]}
    assert {name: kind for name, (kind, _) in outcomes.items()} == {
        "comparison": "compare", "evaluation": "eval", "given": "train", "plan": "plan",
        "study": "study", "training": "train"}
    assert outcomes["comparison"][1] == "4 of 8 runs solved"
    assert outcomes["study"][1] == "1 of 3 claims true, 1 false, 1 undecided"
    assert outcomes["given"][1] == "not solved"
    page = Page(copy / "runs/report.html")
    for said in ("1 < 0 & <b>bold</b>", "1/3 = 33.3% (95 % interval 6.1% to 79.2%)",
                 "ZeroDivisionError: division by zero", "cannot build SST", "the budget of 4000 transitions is used up",
                 'control_duration = 2', "Study coin-toss", "numpy", "torch", "logical cores"):
        assert said in page.text, said
    assert page.tags.count("img") == len(list(copy.rglob("*.png")))


def test_a_page_refers_to_nothing_outside_and_runs_nothing(copy):
    path, sections = write_report("runs")
    page = Page(path)
    assert {reference.partition(",")[0] for reference in page.references if not reference.startswith("#")} == {
        "data:", "data:image/png;base64"}
    assert {reference for reference in page.references if reference.startswith("#")} == {
        f"#folder-{number}" for number in range(1, len(sections) + 1)}
    assert not {"script", "link rel=stylesheet", "iframe", "object"} & set(page.tags)


def test_whatever_a_folder_says_stays_text(copy):
    evil = "</style></pre><script>alert('x')</script><img src=http://evil.example/x.png onerror=alert(1)>\"'"
    result = json.loads((copy / "runs/study/result.json").read_text())
    claim = {"claim": evil, "agrees": False, "numbers": {evil: evil}, "source": evil, "note": evil}
    write_json(copy / "runs/study/result.json", result | {"agrees": [claim], "failed": {evil: evil}})
    write_json(copy / "runs/study/provenance.json", [{evil: evil}])
    write_json(copy / "runs/study/runs/coin-0.json", {evil: evil, "seed": 0})
    write_toml(copy / "runs/study/config.toml", {"kind": "study", "study": evil, "sides": 2})
    (copy / "runs/study/figures/coins.png").rename(copy / "runs/study/figures/\"><script>.png")
    path, _ = write_report("runs/study")
    page = Page(path)
    assert page.text.count(evil) >= 9
    assert not {"script"} & set(page.tags)
    assert page.tags.count("img") == 1
    assert all(reference.startswith("data:") for reference in page.references)


def test_many_runs_are_cut_and_the_page_says_so(copy):
    for number in range(1000, 1000 + MOST_RUNS):
        (copy / f"runs/study/runs/coin-{number}.json").write_text(json.dumps({"seed": number, "curve": [1, 2, 3]}))
    page = Page(write_report("runs/study")[0])
    assert f"The first {MOST_RUNS} of {MOST_RUNS + 3} runs; runs/study/runs/ holds them all." in page.text
    assert page.text.count("coin-1") > 100
    assert f"coin-{1000 + MOST_RUNS - 1}" not in page.text


def test_what_has_not_ended_is_shown_as_such(copy):
    for name in ("plan", "training", "evaluation", "comparison", "study"):
        (copy / f"runs/{name}/result.json").unlink()
    (copy / "runs/comparison/runs/1-Maze-v0/Ex-1.json").unlink()
    _, sections = write_report("runs")
    outcomes = {section.name: section.content.outcome for section in sections}
    assert outcomes["comparison"] == "3 of 7 runs solved; 7 of 8 runs made"
    assert outcomes["study"] == "not finished; 3 runs made"
    assert {outcomes[name] for name in ("plan", "training", "evaluation")} == {"not finished"}


@pytest.mark.parametrize(("file", "content", "named"), [
    ("plan/config.toml", b"env = ", "plan/config.toml is damaged"),
    ("plan/config.toml", b"colour = 3", "plan/config.toml has the kind None; expected plan or train or eval"),
    ("plan/result.json", b"{", "plan/result.json is damaged"),
    ("plan/result.json", b"[]", "plan/result.json is damaged: expected `object`, got `array`"),
    ("plan/result.json", b"{}", "plan/result.json is damaged: object missing required field `solved`"),
    ("plan/provenance.json", b"{}", "plan/provenance.json is damaged"),
    ("plan/tree.png", b"no picture", "plan/tree.png is damaged: not a PNG"),
    ("comparison/runs/1-Maze-v0/Ex-1.json", b"{", "comparison/runs/1-Maze-v0/Ex-1.json is damaged"),
    ("study/runs/coin-1.json", b"3", "study/runs/coin-1.json is damaged"),
])
def test_a_damaged_file_is_named_and_the_other_folders_are_shown(copy, capsys, file, content, named):
    folder = file.partition("/")[0]
    (copy / "runs" / file).write_bytes(content)
    assert main(["report", f"runs/{folder}"]) == 2
    error = capsys.readouterr().err
    assert f"runs/{named}" in error
    assert error.count("\n") == 1
    assert not (copy / "runs" / folder / "report.html").exists()
    assert main(["report", "runs", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert list(answer["damaged"]) == [folder]
    assert f"runs/{named}" in Page(copy / "runs/report.html").text
    assert len(answer["folders"]) == 6


def test_only_a_report_is_replaced(copy):
    page, _ = write_report("runs/plan")
    first = page.read_text()
    assert write_report("runs/plan")[0] == page
    assert page.read_text()[:200] == first[:200]
    page.write_text("<html>my own notes</html>")
    with pytest.raises(RunFolderError, match=r"report.html was not written by pbcs report; choose another --out"):
        write_report("runs/plan")
    assert page.read_text() == "<html>my own notes</html>"
    write_report("runs/plan", copy / "new/page.html")
    assert [path.name for path in (copy / "new").iterdir()] == ["page.html"]


@pytest.mark.parametrize(("folder", "out", "expected"), [
    ("nowhere", None, "nowhere is not a folder"), ("empty", None, "no results in empty"),
    ("runs/plan", "empty", "cannot write empty: it is a folder"),
    ("runs/plan", "runs/plan/config.toml/page.html", "cannot write"),
])
def test_mistakes_are_named(copy, folder, out, expected):
    (copy / "empty").mkdir()
    with pytest.raises(RunFolderError, match=expected):
        write_report(folder, out)


def test_damage_of_one_folder_is_an_error(copy):
    (copy / "runs/plan/result.json").write_text("{")
    with pytest.raises(DamagedFile):
        write_report("runs/plan")


@pytest.mark.parametrize(("seeds", "text"), [
    ([], ""), ([3], "3"), ([2, 0, 1, 1], "0-2"), ([5, 0, 1, 9, 10], "0-1, 5, 9-10")])
def test_seeds_in_words(seeds, text):
    assert format_seeds(seeds) == text


@pytest.mark.parametrize(("value", "text"), [
    (rate(0, 0), "0/0"), (rate(16, 300), "16/300 = 5.3% (95 % interval 3.3% to 8.5%)"),
    ({"2x2": rate(1, 1), "skills": [2, 0.25]}, "2x2 1/1 = 100.0% (95 % interval 20.7% to 100.0%), skills [2, 0.25]"),
])
def test_numbers_in_words(value, text):
    assert format_value(value) == text


def test_a_view_that_is_there_is_linked_and_not_embedded(copy, tmp_path):
    (copy / "runs/plan/view.html").write_text("<script>alert(1)</script>")
    assert "plan/view.html" in Page(write_report("runs").page).references
    elsewhere = write_report("runs/plan", tmp_path / "elsewhere.html").page
    assert "copy/runs/plan/view.html" in Page(elsewhere).references
    assert "script" not in Page(elsewhere).tags
