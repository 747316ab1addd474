"""Plug-ins are found by name, by path, and every mistake says what to do."""

import sys
from importlib.metadata import EntryPoint

import pytest

from pbcs_ompl.core import registry
from pbcs_ompl.core.errors import MissingDependency, PbcsError, UnknownName, did_you_mean


@pytest.fixture
def plugins(monkeypatch):
    """A registry with three planners, one of which needs what is not installed."""
    found = {"Ex": "json:loads", "KPIECE1": "json:dumps", "Lost": "needs_more:Planner"}
    entries = {name: EntryPoint(name, value, "planners") for name, value in found.items()}
    monkeypatch.setattr(registry, "_entries", lambda kind: entries)


def test_names_are_sorted_and_loaded_whatever_the_case(plugins):
    import json

    assert registry.names("planner") == ["Ex", "KPIECE1", "Lost"]
    assert registry.load("planner", "Ex") is json.loads
    assert registry.load("planner", "kpiece1") is json.dumps
    assert registry.load("planner", "json:JSONDecoder") is json.JSONDecoder


@pytest.mark.parametrize(("name", "error", "message"), [
    ("KPIECE", UnknownName, "unknown planner 'KPIECE'; did you mean 'KPIECE1'?"),
    ("zzzzz", UnknownName, "choose from Ex, KPIECE1, Lost"),
    ("json:nothing", PbcsError, "expected module:attribute"),
    ("no_such_module:Planner", PbcsError, "No module named"),
    (":", PbcsError, "expected module:attribute"),
])
def test_mistakes(plugins, name, error, message):
    with pytest.raises(error) as caught:
        registry.load("planner", name)
    assert message in str(caught.value)


def test_missing_library_is_named(plugins, tmp_path, monkeypatch):
    (tmp_path / "needs_more.py").write_text("import surely_not_installed\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingDependency, match="pip install surely_not_installed") as caught:
        registry.load("planner", "Lost")
    assert caught.value.exit_code == 3
    sys.modules.pop("needs_more", None)


def test_our_own_plugins_are_entry_points():
    assert {"Ex", "RRTNH", "RRT", "EST", "KPIECE1", "SST", "PDST"} <= set(registry.names("planner"))
    assert "ddpg" in registry.names("agent")
    registry.load_environments()
    import gymnasium

    assert "pbcs/Maze-v0" in gymnasium.registry


def test_did_you_mean():
    assert did_you_mean("rrt", ["RRT", "EST"]) == "; did you mean 'RRT'?"
    assert did_you_mean("?", ["RRT", "EST"]) == "; choose from EST, RRT"
    assert did_you_mean("?", []) == ""
