"""Files and functions stay small enough to be read at once."""

import ast
import os
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILE_LINES, FUNCTION_LINES = 400, 50
SOURCES = sorted(Path(folder, name).relative_to(ROOT)
                 for folder, _, names in os.walk(ROOT / "pbcs_ompl", followlinks=True) for name in names
                 if name.endswith(".py"))


def too_large(source: Path) -> list[str]:
    """Return what is too large in a file: the file, or functions without their docstrings."""
    text = (ROOT / source).read_text()
    length = text.count("\n")
    found = [f"{source} has {length} lines"] if length > FILE_LINES else []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            documented = ast.get_docstring(node, clean=False)
            body = lines - (0 if documented is None else documented.count("\n") + 1)
            if body > FUNCTION_LINES:
                found.append(f"{source}: {node.name} has {body} lines without its docstring")
    return found


def test_files_and_functions_are_small() -> None:
    assert SOURCES
    found = [one for source in SOURCES for one in too_large(source)]
    assert not found, "\n".join(found)
