"""A signal while a verb is imported: an exception within the import of OMPL would end the process with a core dump."""

import os
import signal
from types import SimpleNamespace

import pytest

from pbcs_ompl import cli


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_for_the_end_of_an_import(monkeypatch, capsys, number):
    imported = []

    def slow_import(name):
        os.kill(os.getpid(), number)
        imported.append(name)
        return SimpleNamespace(run=lambda arguments: pytest.fail("it runs"))

    monkeypatch.setattr(cli, "import_module", slow_import)
    assert cli.main(["doctor"]) == 128 + number
    assert imported == ["pbcs_ompl.cli.doctor"]
    assert capsys.readouterr().err.startswith("pbcs: interrupted; ")
