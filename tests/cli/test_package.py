"""The names of the package: all there, none imported before it is used."""

import subprocess
import sys

import pytest

import pbcs_ompl


@pytest.mark.parametrize("name", pbcs_ompl.__all__)
def test_every_name_is_there(name):
    assert getattr(pbcs_ompl, name).__module__.startswith("pbcs_ompl.")
    assert name in dir(pbcs_ompl)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'trian'"):
        pbcs_ompl.trian  # noqa: B018


def test_importing_costs_nothing():
    command = [sys.executable, "-c", "import sys, pbcs_ompl; print(*sys.modules)"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert not {"numpy", "ompl", "torch", "gymnasium"} & set(run.stdout.split())
