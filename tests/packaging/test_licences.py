"""The page of licences names every dependency that users install."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
OURS = {"dev", "docs"}
"""Extras of those who work on the project."""


def test_every_dependency_is_listed():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    of_users = [all_of for name, all_of in project["optional-dependencies"].items() if name not in OURS]
    extras = [one for all_of in of_users for one in all_of]
    needed = {re.split(r"[\[><=~ ;]", one)[0] for one in [*project["dependencies"], *extras]} - {"pbcs-ompl"}
    listed = set(re.findall(r"^\| ([\w-]+) \| (?:core|`)", (ROOT / "docs" / "licences.md").read_text(), re.MULTILINE))
    assert needed == listed
