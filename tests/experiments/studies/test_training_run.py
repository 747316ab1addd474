"""A training as a study records it."""

import json

import pytest

import pbcs_ompl
from pbcs_ompl.core.errors import UnknownName
from pbcs_ompl.experiments.training_run import trained
from pbcs_ompl.skills import Evaluation

MAZE = {"size": 2}


def test_a_budget_that_ends_first_is_recorded():
    options = {"method": "plain", "seed": 3, "max_transitions": 2000}
    expected = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, **options)
    record, result = trained("pbcs/Maze-v0", MAZE, **options)
    assert record["reason"] == expected.reason
    assert record["transitions"] == record["plan_transitions"] + record["train_transitions"] >= 2000
    assert record["succeeds"] is False
    assert record["cpu_seconds"] > 0
    assert result.chain is not None
    assert json.loads(json.dumps(record)) == record


def test_what_was_learnt_by_the_end_is_tried_once(monkeypatch):
    sure = Evaluation(success_rate=1.0, wilson=(0.2, 1.0), episodes=1, steps_median=1.0, epsilon=0.0)
    monkeypatch.setattr("pbcs_ompl.experiments.training_run.evaluate", lambda *_, **__: sure)
    record, _ = trained("pbcs/Maze-v0", MAZE, method="plain", max_transitions=500)
    assert (record["solved"], record["succeeds"]) == (False, True)


def test_mistakes_are_not_results():
    with pytest.raises(UnknownName):
        trained("pbcs/Maze-v0", MAZE, method="pbcss")
