"""The tutorials as notebooks: `make notebooks` writes and executes docs/_build/notebooks/*.ipynb.

The pages are the source: each block of Python is a cell, and so is each block of commands. Jupyter starts in the
folder of the notebook.
"""

import os
import re
import shutil
import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

DOCS = Path(__file__).parent
COMMANDS = re.compile(r"^```\n((?:pbcs .*\n)+)```$", flags=re.MULTILINE)
PAGE = re.compile(r"\]\((?!https?:)([\w./]+)\.md(#[\w-]+)?\)")


def notebook(text: str) -> nbformat.NotebookNode:
    """Return a page of Markdown as a notebook whose links lead to the site."""
    cells = COMMANDS.sub(r"```python\n%%bash -e\n\1```", text)
    linked = PAGE.sub(lambda found: f"]({_on_the_site(found[1])}.html{found[2] or ''})", cells)
    made = jupytext.reads(linked, fmt="md")
    made.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return made


def _on_the_site(page: str) -> str:
    """Return the way from docs/_build/notebooks to what a tutorial links to."""
    return page if page.startswith("../") else f"../tutorials/{page}"


def main(names: list[str]) -> None:
    """Write the notebooks of these tutorials, or of all; one that does not run ends it."""
    out = DOCS / "_build" / "notebooks"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / "examples").symlink_to(DOCS.parent / "examples")
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for page in sorted((DOCS / "tutorials").glob("*.md")):
        if names and page.stem not in names:
            continue
        made = notebook(page.read_text())
        NotebookClient(made, timeout=600, resources={"metadata": {"path": str(out)}}).execute()
        nbformat.write(made, out / f"{page.stem}.ipynb")
        print(out / f"{page.stem}.ipynb")


if __name__ == "__main__":
    main(sys.argv[1:])
