"""The verbs, end to end on the smallest maze: keys of the JSON, files, pictures, exit status, mistakes."""

import json
import shlex
import subprocess
import sys

import numpy as np
import pytest

from pbcs_ompl.cli import arguments, main

MAZE = "--env pbcs/Maze-v0 --env-kwargs '{\"size\": 2}'"
KEYS = {
    "plan": {"solved", "transitions", "seconds", "nodes", "path_length", "replay_ok", "planner", "env",
             "seed", "out"},
    "train": {"solved", "success_rate", "wilson", "skills", "plan_transitions", "train_transitions",
              "updates", "seconds", "seed", "out"},
    "eval": {"success_rate", "wilson", "episodes", "steps_median"},
    "compare": {"rows", "database"},
}
ROW = {"planner", "solved", "runs", "wilson", "transitions_median", "seconds_median"}


@pytest.fixture
def pbcs(tmp_path, monkeypatch, capsys):
    """Run a command line in an empty folder; return the status, the JSON object or stdout, and stderr."""
    monkeypatch.chdir(tmp_path)

    def run(line):
        status = main(shlex.split(line))
        shown = capsys.readouterr()
        return status, json.loads(shown.out) if "--json" in line and shown.out else shown.out, shown.err

    return run


def test_plan_without_pictures(pbcs, tmp_path):
    status, plan, _ = pbcs(f"plan {MAZE} --seed 3 --no-pictures --out bare --json")
    assert (status, plan["solved"]) == (0, True)
    assert (tmp_path / "bare/tree.npz").exists()
    assert not (tmp_path / "bare/tree.png").exists()


def test_plan_then_train_then_eval(pbcs, tmp_path):
    status, plan, _ = pbcs(f"plan {MAZE} --seed 3 --json")
    assert status == 0
    assert KEYS["plan"] <= set(plan)
    assert (plan["solved"], plan["replay_ok"], plan["seed"]) == (True, True, 3)
    assert plan["out"] == "runs/plan-Maze-v0-Rides-3"
    files = {path.name for path in (tmp_path / plan["out"]).iterdir()}
    assert files == {".sha256", "config.toml", "provenance.json", "result.json", "trajectory.npz", "tree.npz",
                     "tree.png"}

    status, result, error = pbcs(f"train {MAZE} --path {plan['out']} --out runs/chain --json")
    assert status == 0
    assert KEYS["train"] <= set(result)
    assert result["solved"]
    assert (tmp_path / "runs/chain/chain.png").stat().st_size > 10_000
    assert "next      pbcs eval runs/chain" in error

    status, evaluation, _ = pbcs("eval runs/chain --episodes 20 --epsilon 0.1 --json")
    assert status == 0
    assert KEYS["eval"] <= set(evaluation)
    assert evaluation["episodes"] == 20


def test_compare(pbcs, tmp_path):
    status, comparison, _ = pbcs(f"compare --planners Ex KPIECE1 SST {MAZE} --seeds 2 --json")
    assert status == 0
    assert KEYS["compare"] <= set(comparison)
    assert [row["planner"] for row in comparison["rows"]] == ["Ex", "KPIECE1", "SST"]
    assert all(set(row) >= ROW for row in comparison["rows"])
    assert [row["solved"] for row in comparison["rows"]] == [2, 2, 0]
    assert (tmp_path / "runs/compare-Maze-v0-Ex-KPIECE1-SST-2/compare.png").exists()


def test_compare_in_several_environments_with_options(pbcs, tmp_path):
    status, found, error = pbcs("compare --planners Ex RandomWalk --planner-kwargs '{\"Ex\": {\"bin_size\": 0.3}}' "
                                "--env pbcs/Maze-v0 pbcs/Box-v0 --start-seed 4 --seeds 6 --max-seconds 60 "
                                "--max-transitions 2000 --out both --json")
    assert status == 0
    labels = ["pbcs/Maze-v0(start_seed=4)", "pbcs/Box-v0(start_seed=4)"]
    assert [row["environment"] for row in found["rows"]] == [labels[0], labels[0], labels[1], labels[1]]
    assert [test["environment"] for test in found["tests"]] == labels
    assert all(f"in         {label}\n" in error for label in labels)  # as wide as "RandomWalk"
    assert "pair       Ex needs less than RandomWalk in" in error
    assert {"compare.png", "coverage.png", "comparison.db", "comparison-1-Maze-v0.log", "comparison-2-Box-v0.log"} < \
        {path.name for path in (tmp_path / "both").iterdir()}
    assert "bin_size = 0.3" in (tmp_path / "both/comparison-1-Maze-v0.log").read_text()


def test_doctor(pbcs):
    status, found, _ = pbcs(f"doctor {MAZE} --json")
    assert status == 0
    assert found["versions"]["ompl"]
    assert found["planners"]["Ex"] == "ready"
    assert "cannot build SST" in found["planners"]["SST"]
    assert found["environment"]["ok"]


def test_a_budget_that_ends_is_no_error_and_the_tree_is_kept(pbcs, tmp_path):
    status, plan, _ = pbcs(f"plan {MAZE} --max-transitions 50 --out tight --json")
    assert status == 1
    assert plan["solved"] is False
    assert (tmp_path / "tight/tree.npz").exists()
    assert (tmp_path / "tight/tree.png").exists()


def test_a_training_that_runs_out_of_budget_continues_with_a_larger_one(pbcs):
    status, result, error = pbcs(f"train {MAZE} --max-transitions 600 --out small --json")
    assert status == 1
    assert result["solved"] is False
    assert "pbcs train --resume small --max-transitions N" in error
    status, result, _ = pbcs("train --resume small --max-transitions 1000000 --json")
    assert status == 0
    assert result["solved"]


@pytest.mark.parametrize("verb", ["eval", "export --to csv", "distill", "view"])
def test_a_folder_that_does_not_exist_is_named_before_anything_is_imported(verb, pbcs, tmp_path, monkeypatch):
    monkeypatch.setattr("pbcs_ompl.cli._import", None)
    (tmp_path / "runs/car-chain").mkdir(parents=True)
    assert pbcs(f"{verb} runs/car-chian") == (2, "", "pbcs: error: runs/car-chian does not exist; did you mean "
                                                     "'runs/car-chain'?\n")


def test_an_interrupted_training_says_how_to_go_on(pbcs, monkeypatch):
    def interrupt(*_, out, **__):
        out.mkdir()
        (out / "config.toml").write_text("")
        raise KeyboardInterrupt

    monkeypatch.setattr("pbcs_ompl.cli.train.train", interrupt)
    status, _, error = pbcs(f"train {MAZE} --out stopped")
    assert status == 130
    assert error == "pbcs: interrupted; continue with: pbcs train --resume stopped\n"


def test_a_picture_that_cannot_be_written_does_not_cost_the_result(pbcs, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pbcs_ompl.figures.canvas.save", full)
    status, plan, error = pbcs(f"plan {MAZE} --json")
    assert (status, plan["solved"]) == (0, True)
    assert "no picture tree.png" in error


def test_help_names_every_method():
    from pbcs_ompl.skills.config import METHODS

    shown = arguments.build_parser().verbs["train"].format_help()
    assert all(method in shown for method in METHODS)


MISTAKES = [
    ("plan --env pbcs/Mase-v0", 2, "did you mean 'pbcs/Maze-v0'?"),
    ("plan --env pbcs/Maze-v0 --env-kwargs '{\"sise\": 3}'", 2, "did you mean 'size'?"),
    ("plan --env pbcs/Maze-v0 --env-kwargs '{\"size\": 0}'", 2, "size"),
    ("plan --env pbcs/Maze-v0 --env-kwargs '{\"size\": 10000}'", 2, "size"),
    ("plan --env pbcs/Maze-v0 --env-kwargs '{\"start\": [0.0, 0.5]}'", 2, "wall"),
    ("plan --env pbcs/Maze-v0 --env-kwargs '{\"goal\": [1.0, 9.0]}'", 2, "goal"),
    ("plan --env Pendulum-v1 --goal rewrd>0", 2, "did you mean 'reward'?"),
    ("plan --env Pendulum-v1 --feature obs[0:9]", 2, "obs has 3 numbers"),
    (f"plan {MAZE} --planner KPIECE", 2, "did you mean 'KPIECE1'?"),
    (f"plan {MAZE} --planner nowhere:Planner", 2, "nowhere"),
    (f"plan {MAZE} --planner SST", 3, "cannot build SST"),
    (f"plan {MAZE} --planner-kwargs '{{\"bin_sise\": 1}}'", 2, "did you mean 'bin_size'?"),
    (f"plan {MAZE} --planner-kwargs '{{\"bin_size\": -1}}'", 2, "bin_size"),
    (f"plan {MAZE} --out taken", 2, "taken already exists"),
    (f"train {MAZE} --agent dppg", 2, "did you mean 'ddpg'?"),
    (f"train {MAZE} --path taken", 2, "taken/trajectory.npz does not exist"),
    (f"train {MAZE} --path taken/truncated.npz", 2, "truncated.npz is damaged"),
    (f"train {MAZE} --path taken/foreign.npz", 2, "is not a trajectory"),
    ("train --resume taken", 2, "taken/config.toml does not exist"),
    ("eval taken", 2, "chain.json does not exist"),
    (f"compare --planners Ex Exx {MAZE}", 2, "did you mean 'Ex'?"),
    (f"compare --planners Ex Ex {MAZE}", 2, "twice"),
    (f"compare --planners Ex --planner-kwargs '{{\"EX\": {{}}}}' {MAZE}", 2, "did you mean 'Ex'?"),
    (f"compare --planners Ex --planner-kwargs '{{\"Ex\": 1}}' {MAZE}", 2, "options for 'Ex' are 1"),
    (f"compare --planners Ex --planner-kwargs '{{\"Ex\": {{\"bin_sise\": 1}}}}' {MAZE}", 2, "did you mean 'bin_size'?"),
    ("compare --planners Ex --env pbcs/Maze-v0 pbcs/Maze-v0", 2, "twice"),
    ("compare --planners Ex --env pbcs/Maze-v0 pbcs/Box-v0 --env-kwargs '{}' '{}' '{}'", 2, "2 environments and"),
    (f"compare --planners Ex {MAZE} --max-memory 0", 2, "at least 1"),
    ("doctor --env nowhere/Thing-v0", 2, "unknown environment"),
]


@pytest.mark.parametrize(("line", "status", "expected"), MISTAKES)
def test_a_mistake_is_one_line_and_leaves_nothing_behind(pbcs, tmp_path, line, status, expected):
    taken = tmp_path / "taken"
    taken.mkdir()
    np.savez(taken / "foreign.npz", states=np.zeros(3))
    (taken / "truncated.npz").write_bytes((taken / "foreign.npz").read_bytes()[:100])
    before = sorted(tmp_path.rglob("*"))
    got, out, error = pbcs(line)
    assert got == status
    assert out == ""
    assert error.startswith("pbcs: error: ")
    assert error.count("\n") == 1
    assert expected in error
    assert [path for path in sorted(tmp_path.rglob("*")) if path not in before and path.is_file()] == []


BROKEN = """
from pbcs_ompl.planners import Strategy

class Broken(Strategy):
    def select(self, tree, count):
        raise {error}
"""


@pytest.mark.parametrize(("error", "status", "expected"), [
    ("ValueError('oops')", 2, "pbcs: error: Broken: the environment, goal or strategy raised ValueError: oops"),
    ("KeyboardInterrupt", 130, "pbcs: interrupted; run the same command again to start over"),
])
def test_a_users_exception_is_one_line_even_at_exit(tmp_path, error, status, expected):
    """In a process of its own, because OMPL's bindings report what is left only when Python ends."""
    (tmp_path / "broken.py").write_text(BROKEN.format(error=error))
    command = [sys.executable, "-m", "pbcs_ompl.cli", *shlex.split(f"plan {MAZE} --planner broken:Broken")]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == status
    assert run.stderr.startswith(expected)
    assert run.stderr.count("\n") == 1
    assert run.stdout == ""


def test_two_plans_of_one_environment_do_not_mix(pbcs):
    pbcs(f"plan {MAZE} --out two")
    status, _, error = pbcs("train --env pbcs/Maze-v0 --env-kwargs '{\"size\": 3}' --path two --out three")
    assert status == 2
    assert "was made in pbcs/Maze-v0" in error
