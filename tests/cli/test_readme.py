"""What the README and the docs show works as it stands there."""

import re
import shlex
from importlib.util import find_spec
from pathlib import Path

import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.cli.arguments import build_parser, parse
from pbcs_ompl.experiments.study import find_study

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
README = PAGES[0].read_text()
IN_ORDER = [ROOT / "docs" / name for name in ("deploy.md", "export.md", "results.md", "tutorials/gymnasium.md")]
"""Pages whose commands and snippets use what those above them have made."""
ALONE = [page for page in PAGES if page not in IN_ORDER]
LIBRARIES = ("minari", "h5py", "onnx", "onnxruntime", "mujoco")


def blocks(text, language):
    """Return the fenced blocks of one language ("" for commands)."""
    fences = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return [block for name, block in fences if name == language]


def commands(text):
    lines = "\n".join(blocks(text, "")).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("pbcs ")]


LONG = re.compile(r"\bpbcs (train|study|compare|distill)\b|\b(train|compare|train_follower)\(")
"""What takes long: it trains, or starts processes."""


def slow_if_long(text):
    """Return the marks of a test of commands or code."""
    return [pytest.mark.slow] if LONG.search(text) else []


SNIPPETS = [pytest.param(code, id=f"{page.name}-{number}", marks=slow_if_long(code) if page in ALONE[1:] else [])
            for page in ALONE for number, code in enumerate(blocks(page.read_text(), "python"))]
ELSEWHERE = [line for page in ALONE[1:] for line in commands(page.read_text())]
STUDY = re.compile(r"pbcs study (\S+)(?!.*--emit)")
"""A line that makes the runs of a study, and so takes long."""


def study_of(line):
    """Return the study whose runs a line makes; None if it makes none."""
    found = STUDY.match(line)
    return None if found is None or found[1].startswith("--") else found[1]


def is_first_of_its_study(line):
    return line == next(other for other in ELSEWHERE if study_of(other) == study_of(line))


@pytest.mark.parametrize("code", SNIPPETS)
def test_python_works_when_pasted(code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = re.sub(r'\{"size": \d+, "maze_seed": \d+\}', '{"size": 2}', code)  # learnt in seconds
    exec(compile(small, "snippet", "exec"), {"__name__": "__main__"})


def test_the_readmes_command_lines_work_one_after_the_other(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for line in commands(README):
        small = re.sub(r'"size": \d+, "maze_seed": \d+', '"size": 2', line).replace("--seeds 10", "--seeds 2")
        assert main(shlex.split(small)[1:]) == 0, line
        assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("line", [pytest.param(line, marks=slow_if_long(line)) for line in ELSEWHERE])
def test_command_lines_of_the_docs_work(line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    if study_of(line) is None or is_first_of_its_study(line):
        assert main(shlex.split(line)[1:]) == 0
    else:
        assert find_study(parse(build_parser(), shlex.split(line)[1:]).id).id == study_of(line)


@pytest.mark.parametrize("page", [pytest.param(page, id=page.name, marks=slow_if_long(page.read_text()))
                                  for page in IN_ORDER])
def test_pages_work_from_top_to_bottom(page, tmp_path, monkeypatch, capsys):
    """What needs a library that is not installed here is refused, and named, or left out."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", "")
    monkeypatch.syspath_prepend(str(tmp_path))
    missing = [name for name in LIBRARIES if find_spec(name) is None]
    text = re.sub(r'\{"size": \d+, "maze_seed": \d+\}', '{"size": 2}', page.read_text())
    left_out = False
    for language, block in re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL):
        if language == "python" and any(f"import {name}" in block or f"from_{name}" in block for name in missing):
            left_out = True
        elif language == "python":
            exec(compile(block, page.name, "exec"), {"__name__": "__main__"})
        for line in commands(f"```\n{block}```") if language == "" else ():
            status = main(shlex.split(line)[1:])
            error = capsys.readouterr().err
            named = status == 3 and any(name in error for name in missing)
            assert status == 0 or named or (left_out and "does not exist" in error), f"{line}: {error}"


def test_make_targets_exist():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    for page in PAGES:
        named = re.findall(r"(?:^|`)make ([a-z]+)", page.read_text(), flags=re.MULTILINE)
        assert set(named) <= targets, page.name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        assert target.startswith("http") or (page.parent / target).exists(), target


def test_the_first_forty_lines_hold_what_a_visitor_needs():
    head = "\n".join(README.splitlines()[:40])
    assert head.count("![") == 1
    assert "make demo" in head
    assert "make test" in head
    assert "```python" in head
    assert head.count("```") == 4


def test_every_example_is_in_the_gallery():
    page = (ROOT / "docs" / "gallery.md").read_text()
    for path in (ROOT / "examples").glob("*.py"):
        assert f"literalinclude}} ../examples/{path.name}" in page
        assert path.read_text().split('"""')[1].strip().splitlines()[0] in page  # its question


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 90


def test_every_folder_of_the_overview_exists():
    page = (ROOT / "docs" / "architecture.md").read_text()
    tree = next(block for block in blocks(page, "") if "resettable/" in block)
    named = {("pbcs_ompl/" if indent else "") + name
             for indent, name in re.findall(r"^( *)(\w+)/", tree, flags=re.MULTILINE)}
    assert all((ROOT / name).is_dir() for name in named)
    packages = {f"pbcs_ompl/{path.parent.name}" for path in (ROOT / "pbcs_ompl").glob("*/__init__.py")}
    assert packages - named == {"pbcs_ompl/planners", "pbcs_ompl/envs"}


@pytest.mark.slow
def test_the_picture_is_what_its_command_makes(tmp_path, monkeypatch):
    """The command is that of `make demo`, which the caption names."""
    from matplotlib.image import imread

    page = (ROOT / "docs" / "skills.md").read_text()
    assert "`chain.png` of `make demo`" in page
    (recipe,) = re.findall(r"^\t\$\(BIN\)/pbcs (train .*)$", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(recipe)) == 0
    shown = "docs/pictures/chain.png"
    made, kept = imread(tmp_path / "runs/demo/chain.png"), imread(ROOT / shown)
    assert made.shape == kept.shape
    different = (abs(made - kept) > 0.1).any(axis=2).mean()
    # Another processor rounds otherwise and trains another chain of the same plan: its lines are 2 % of the pixels.
    assert different < 0.04, f"{different:.1%} of the pixels differ: copy runs/demo/chain.png of `make demo` to {shown}"
