"""The notebooks are the tutorials: every snippet and every command of a page is a cell, and runs."""

import re
from pathlib import Path
from runpy import run_path

import pytest

nbformat = pytest.importorskip("nbformat")
pytest.importorskip("jupytext")
DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted((DOCS / "tutorials").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_is_a_cell_and_every_link_leads_to_a_page(page):
    text = page.read_text()
    made = run_path(str(DOCS / "notebooks.py"))["notebook"](text)
    nbformat.validate(made)
    cells = [cell.source for cell in made.cells if cell.cell_type == "code"]
    blocks = re.findall(r"^```(?:python)?\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    assert [cell.removeprefix("%%bash -e\n") for cell in cells] == [block.rstrip() for block in blocks]
    assert all(cell.startswith("%%bash -e\n") for cell in cells if re.match(r"(%%.*\n)?pbcs ", cell))
    for target in re.findall(r"\]\(([\w./]+)\.html", "".join(cell.source for cell in made.cells)):
        assert (DOCS / target.removeprefix("../")).with_suffix(".md").exists()


@pytest.mark.slow
def test_they_run():
    pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    run_path(str(DOCS / "notebooks.py"))["main"]([])
    for page in PAGES:
        made = nbformat.read(DOCS / "_build" / "notebooks" / f"{page.stem}.ipynb", as_version=4)
        outputs = [output for cell in made.cells if cell.cell_type == "code" for output in cell.outputs]
        assert outputs
        assert not [output for output in outputs if output.output_type == "error"]
