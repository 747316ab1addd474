"""Every public name of `pbcs_ompl` has an example in its docstring, and the example does what it says."""

import doctest
import inspect

import pytest

import pbcs_ompl

SECONDS = {"compare", "Comparison", "distill", "DistillResult", "run_study", "StudyResult", "SkillChain"}
NAMES = [pytest.param(name, marks=[pytest.mark.slow] if name in SECONDS else [])
         for name in pbcs_ompl.__all__ if callable(getattr(pbcs_ompl, name))]


@pytest.mark.parametrize("name", NAMES)
def test_the_example_of_a_public_name(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = inspect.getdoc(getattr(pbcs_ompl, name)) or ""
    example = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    assert example.examples, f"pbcs_ompl.{name} has no example"
    said: list[str] = []
    outcome = doctest.DocTestRunner(verbose=False).run(example, out=said.append)
    assert outcome.failed == 0, "".join(said)
