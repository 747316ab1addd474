"""`pbcs doctor --all` writes a page and JSON; its options go with it alone."""

import json
from pathlib import Path

import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.resettable import survey


def test_it_writes_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(survey, "registered", lambda: {"pbcs/Box-v0": "pbcs_ompl.envs"})
    assert main(["doctor", "--all", "--out", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out.strip().splitlines()[-1])
    assert found["verdicts"]["exact"] == 1
    assert "| `pbcs/Box-v0` | exact |" in (tmp_path / "environments.md").read_text()
    assert json.loads((tmp_path / "environments.json").read_text())[0]["id"] == "pbcs/Box-v0"


@pytest.mark.parametrize(("words", "complaint"), [
    (["--all", "--env", "pbcs/Box-v0"], "leave out --env"), (["--out", "x"], "--out goes with --all"),
    (["--max-seconds", "3"], "--max-seconds goes with --all"),
])
def test_options_go_with_it(words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", *words]) == 2
    assert complaint in capsys.readouterr().err
