"""What the tests of comparisons share."""

import os

import pytest


@pytest.fixture
def misbehaving(request, monkeypatch):
    """Let this and spawned processes import the module next to this file."""
    folder = str(request.path.parent)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([folder, os.environ.get("PYTHONPATH", "")]))
