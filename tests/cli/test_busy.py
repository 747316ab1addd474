"""A command that takes long says with what."""

import time

import pytest

from pbcs_ompl.cli import busy


def test_it_says_what_it_is_busy_with(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(busy, "EVERY", 0.01)
    with busy.Busy("pbcs doctor") as watch:
        watch.stage("counting sheep")
        while "counting sheep" not in (said := capsys.readouterr().err):
            time.sleep(0.01)
    assert said.startswith("pbcs doctor: ")
