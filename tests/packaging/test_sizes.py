"""Files and functions stay small enough to be read at once."""

import ast
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILE_LINES, FUNCTION_LINES = 400, 50
SOURCES = sorted(Path(folder, name).relative_to(ROOT)
                 for folder, _, names in os.walk(ROOT / "pbcs_ompl", followlinks=True) for name in names
                 if name.endswith(".py"))


@pytest.mark.parametrize("source", SOURCES, ids=str)
def test_files_and_functions_are_small(source: Path) -> None:
    text = (ROOT / source).read_text()
    assert text.count("\n") <= FILE_LINES
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            documented = ast.get_docstring(node, clean=False)
            body = lines - (0 if documented is None else documented.count("\n") + 1)
            assert body <= FUNCTION_LINES, f"{node.name} has {body} lines without its docstring"
