"""The verbs at `pbcs_ompl.*`: one signature, any form of an environment, a result whatever happens."""

import inspect
import typing
from pathlib import Path
from typing import Any

import gymnasium
import pytest

import pbcs_ompl
from pbcs_ompl import EnvSpec
from pbcs_ompl.core.errors import PbcsError

ID, KWARGS = "pbcs/Maze-v0", {"size": 2}
TASK = {"goal", "feature", "start_seed"}
ON_ENVIRONMENTS = ["plan", "train", "evaluate", "compare", "make", "check_resettable"]
FORMS = {
    "id": lambda: (ID, {"env_kwargs": KWARGS}),
    "spec": lambda: (EnvSpec(ID, KWARGS), {}),
    "gymnasium": lambda: (gymnasium.make(ID, **KWARGS), {}),
    "model": lambda: (pbcs_ompl.make(ID, KWARGS), {}),
}


@pytest.mark.parametrize("name", [*ON_ENVIRONMENTS, "resume", "run_study", "write_report"])
def test_parameters_are_explicit_and_typed(name: str) -> None:
    verb = getattr(pbcs_ompl, name)
    parameters = inspect.signature(verb).parameters.values()
    # Only `make` takes options of the environment as they are, as `gymnasium.make` does.
    assert all(p.kind is not p.VAR_KEYWORD for p in parameters) or name == "make"
    assert set(typing.get_type_hints(verb)) >= {p.name for p in parameters} | {"return"}
    if len(parameters) >= 3:
        assert "Args:" in (verb.__doc__ or "")


@pytest.mark.parametrize("name", ON_ENVIRONMENTS)
def test_the_task_is_named_in_the_same_way_everywhere(name: str) -> None:
    assert set(inspect.signature(getattr(pbcs_ompl, name)).parameters) >= {"env_kwargs"} | TASK


@pytest.fixture(scope="module")
def trained() -> Any:
    """A short training: whether it is solved does not matter."""
    return pbcs_ompl.train(ID, env_kwargs=KWARGS, seed=1, max_transitions=60_000)


@pytest.mark.parametrize("form", FORMS)
def test_every_verb_takes_every_form_of_an_environment(form: str, trained: Any) -> None:
    env, options = FORMS[form]()
    found = pbcs_ompl.plan(env, seed=1, **options)
    assert found.solved
    assert pbcs_ompl.make(env, **options).spec == EnvSpec(ID, KWARGS)
    assert pbcs_ompl.check_resettable(env, **options).ok
    assert pbcs_ompl.evaluate(trained.chain, env, episodes=2, **options).episodes == 2
    again = pbcs_ompl.train(env, trajectory=found.trajectory, seed=1, max_transitions=500, **options)
    assert (again.solved, again.plan_transitions) == (False, 0)


def test_compare_takes_every_form_of_an_environment() -> None:
    mazes: list[dict[str, Any]] = [KWARGS | {"maze_seed": seed} for seed in range(4)]
    environments = [ID, EnvSpec(ID, mazes[1]), gymnasium.make(ID, **mazes[2]), pbcs_ompl.make(ID, mazes[3])]
    found = pbcs_ompl.compare(["Ex"], environments, env_kwargs=[mazes[0], {}, {}, {}], seeds=1)
    assert [row["solved"] for row in found.rows] == [1, 1, 1, 1]
    assert len({row["environment"] for row in found.rows}) == 4


def test_not_solved_is_a_field() -> None:
    assert not pbcs_ompl.plan(ID, env_kwargs=KWARGS, max_transitions=3).solved
    for budget in (3, 600):
        result = pbcs_ompl.train(ID, env_kwargs=KWARGS, max_transitions=budget)
        assert not result.solved
        assert result.summary()["solved"] is False


@pytest.mark.parametrize(("name", "arguments"), [
    ("plan", {}), ("train", {}), ("make", {}), ("check_resettable", {}), ("compare", {"planners": ["Ex"]})])
@pytest.mark.parametrize(("env", "complaint"), [
    ("pbcs/Maze-v1", "did you mean|unknown environment"), (3, "expected"), (None, "expected")])
def test_what_is_no_environment_meets_a_named_error(name: str, arguments: dict[str, Any], env: Any,
                                                    complaint: str) -> None:
    with pytest.raises(PbcsError, match=complaint):
        getattr(pbcs_ompl, name)(**arguments, env=env)


def test_what_is_no_controller_meets_a_named_error(tmp_path: Path) -> None:
    for controller in (None, "runs/demo", 3):
        with pytest.raises(PbcsError, match="expected"):
            pbcs_ompl.evaluate(controller, ID)
