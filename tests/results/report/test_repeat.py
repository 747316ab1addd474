"""The command that a report prints repeats the run: parsed, it has the settings of the folder's config.toml."""

import shlex
import tomllib
from inspect import signature
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from pbcs_ompl.cli import compare, eval, main, plan, study, train
from pbcs_ompl.cli.arguments import build_parser, environment, parse
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.experiments.sweep import environment_specs, make_sweep
from pbcs_ompl.results.command_line import command, environment_words
from pbcs_ompl.results.files import read_toml, to_toml
from pbcs_ompl.results.folder import Folder, read_folder
from pbcs_ompl.results.report.repeat import repeating, resuming, viewing
from pbcs_ompl.skills.config import TrainConfig


class Caught(BaseException):
    """The verb has called the library."""


@pytest.fixture
def call(laboratory, monkeypatch):
    """Run a command line up to the library's function; return what that was called with."""
    monkeypatch.chdir(laboratory)

    def catch(*arguments, **options):
        raise Caught(arguments, options)

    for module, name in ((plan, "plan"), (train, "train"), (eval, "evaluate"), (compare, "compare"),
                         (study, "run_study")):
        monkeypatch.setattr(module, name, catch)

    def run(line):
        assert line.startswith("pbcs ")
        with pytest.raises(Caught) as caught:
            main(shlex.split(line)[1:])
        return caught.value.args

    return run


def settings(folder):
    return {key: value for key, value in read_toml(folder / "config.toml").items() if key != "versions"}


def test_a_plan(laboratory, call):
    folder = Path("runs/plan")
    (model, planner), options = call(repeating(read_folder(folder)))
    again = {"kind": "plan", "environment": model.spec.to_dict(), "planner": planner}
    assert again | {name: options[name] for name in options.keys() - {"out", "on_progress"}} == settings(folder)
    assert settings(folder)["environment"]["goal"] == "reward>0"


@pytest.mark.parametrize("name", ["training", "given"])
def test_a_training(laboratory, call, name):
    folder = Path("runs") / name
    (environment,), options = call(repeating(read_folder(folder)))
    planned = options.pop("trajectory") is not None
    choices = {name: value for name, value in options.items() if name in signature(TrainConfig.resolve).parameters}
    config = TrainConfig.resolve(**choices, planned=planned)
    again = {"kind": "train", **config.to_dict(), "environment": environment.to_dict()}
    assert tomllib.loads(to_toml(again)) == settings(folder)
    assert planned == (name == "given")


def test_an_evaluation(laboratory, call):
    (chain,), options = call(repeating(read_folder(Path("runs/evaluation"))))
    again = {"kind": "eval", "environment": chain.environment.to_dict(), "chain": "runs/training", **options}
    assert again == settings(Path("runs/evaluation"))
    assert chain.num_policies > 0


def test_a_comparison(laboratory, call):
    folder = read_folder(Path("runs/comparison"))
    (planners, env), options = call(repeating(folder))
    task = {name: options[name] for name in ("env_kwargs", "goal", "feature", "start_seed")}
    chosen = {name: options[name] for name in ("seeds", "max_transitions", "max_seconds", "max_memory", "improve")}
    sweep = make_sweep(planners, environment_specs(env, **task), **chosen)
    assert to_toml(sweep.config()) == to_toml(folder.config)


def test_a_comparison_of_other_seeds_is_a_script(laboratory, monkeypatch):
    folder = read_folder(laboratory / "runs/comparison")
    other = Folder(folder.path, folder.kind, folder.config | {"seeds": [7, 3], "max_memory": 900.5}, None, [])
    called = []
    monkeypatch.setattr("pbcs_ompl.experiments.compare.compare",
                        lambda *words, out, **options: called.append((words, options)))
    exec(repeating(other), {"__name__": "__main__"})
    (words, options), = called
    assert to_toml(make_sweep(*words, **options).config()) == to_toml(other.config)


def test_a_study_and_one_that_was_changed(laboratory, call, monkeypatch, tmp_path):
    folder = read_folder(Path("runs/study"))
    (found,), options = call(repeating(folder))
    again = {"kind": "study", "study": found.id, "folder": str(found.folder), "seeds": options["seeds"], **found.sweep}
    assert again == folder.config
    changed = Folder(folder.path, folder.kind, folder.config | {"sides": 3}, folder.result, [])
    assert repeating(changed) == ""
    assert repeating(Folder(folder.path, folder.kind, folder.config | {"folder": "gone"}, None, [])) == ""


def test_what_has_not_ended_can_go_on(laboratory, call, monkeypatch):
    assert resuming(read_folder(Path("runs/training"))) == ""
    assert resuming(read_folder(Path("runs/given"))) == "pbcs train --resume runs/given --max-transitions 8000"
    for name in ("comparison", "study"):
        folder = read_folder(Path("runs") / name)
        assert resuming(folder) == ""
        _, options = call(resuming(Folder(folder.path, folder.kind, folder.config, None, [])))
        assert Path(options["out"]) == folder.path


def test_plans_and_trainings_can_be_seen(laboratory):
    found = {name: viewing(read_folder(laboratory / "runs" / name)) for name in ("plan", "training", "comparison")}
    places = {name: laboratory / "runs" / name for name in found}
    assert found == {"plan": f"pbcs view {places['plan']}", "training": f"pbcs view {places['training']}",
                     "comparison": ""}


@pytest.mark.parametrize(("changes", "name"), [
    ({"planner": "Mine"}, "plan"), ({"environment": {"id": "nowhere/Thing-v0"}}, "plan"),
    ({"agent": "Mine"}, "training")])
def test_python_objects_have_no_command(laboratory, changes, name):
    folder = read_folder(laboratory / "runs" / name)
    assert repeating(Folder(folder.path, folder.kind, folder.config | changes, None, [])) == ""


words = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=6)
values = st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5)
options = st.dictionaries(words, values | st.lists(values, max_size=3), max_size=3)
rules = st.fixed_dictionaries({}, optional={"goal": words, "feature": words, "start_seed": st.integers(0, 99)})


@hypothesis_settings(suppress_health_check=[HealthCheck.too_slow])  # the first draw makes a table of characters
@given(env=words.filter(lambda word: not word.startswith("-")), options=options, rules=rules)
def test_any_environment_can_be_named_on_the_command_line(env, options, rules):
    spec = EnvSpec(env, options, **rules)
    parsed = parse(build_parser(), shlex.split(command(["plan", *environment_words(spec)]))[1:])
    assert environment(parsed) == spec
