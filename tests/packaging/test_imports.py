"""The direction of imports, as the pages draw it, is what `lint-imports` checks."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]


def layers() -> str:
    """The layers of the import contract as one line, from the top down."""
    (contract,) = [contract for contract in CONTRACTS if contract["type"] == "layers"]
    names = [re.sub(r"pbcs_ompl\.", "", layer).replace(" | ", ", ") for layer in contract["layers"]]
    return " -> ".join(names)


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.md"])
def test_pages_show_the_layers_of_the_contract(page: str) -> None:
    shown = " ".join((ROOT / page).read_text().split())
    assert layers() in shown, f"{page} lacks the line: {layers()}"


def test_every_subpackage_has_a_place() -> None:
    shown = set(re.findall(r"\w+", layers()))
    packages = {path.parent.name for path in (ROOT / "pbcs_ompl").glob("*/__init__.py")}
    assert packages - shown == {"planners", "envs"}
