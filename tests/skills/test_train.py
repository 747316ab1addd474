"""Training end to end: it solves, repeats itself, stops anywhere and resumes; its mistakes are named."""

import json
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.errors import (
    CallbackFailed,
    DamagedFile,
    InvalidOption,
    Mismatch,
    RunFolderError,
    UnknownName,
)
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import read_toml
from pbcs_ompl.skills import Evaluation, SkillChain, resume, train
from pbcs_ompl.skills.config import usual_method
from pbcs_ompl.skills.criterion import Outcome, failure
from pbcs_ompl.skills.policy import policy_to_arrays
from pbcs_ompl.skills.settings import CriterionSettings

MAZE = {"size": 2}


def fingerprint(result):
    """Everything that two equal trainings share."""
    arrays = [array for skill in result.chain.skills for array in policy_to_arrays(skill.policy).values()]
    summary = {name: value for name, value in result.summary().items() if name not in ("seconds", "out")}
    return summary, [array.tobytes() for array in arrays]


def test_pbcs_solves_the_small_maze(tmp_path):
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=0, out=tmp_path / "run")
    assert result.solved
    assert result.robust.success_rate >= 0.95
    assert {path.name for path in (tmp_path / "run").iterdir()} == {
        ".sha256", "config.toml", "provenance.json", "result.json", "plan.json", "trajectory.npz", "chain",
        "progress.csv"}
    chain = SkillChain.load(tmp_path / "run" / "chain")
    model = make("pbcs/Maze-v0", MAZE)
    np.testing.assert_array_equal(chain.rollout(model, model.initial_state(0)),
                                  result.chain.rollout(model, model.initial_state(0)))
    assert json.loads((tmp_path / "run" / "result.json").read_text())["train_transitions"] == result.train_transitions


def angle_squared(outcome):
    return outcome.env.state[:1] ** 2


def test_the_usual_method_is_path_following_where_the_feature_is_observed():
    assert usual_method("fast", make("pbcs/Maze-v0", MAZE)) == "follow"
    assert usual_method("thesis", make("pbcs/Maze-v0", MAZE)) == "pbcs"
    assert usual_method("fast", make("Pendulum-v1", goal="reward>-0.01")) == "follow"
    with pytest.warns(UserWarning, match="the method is pbcs"):
        assert usual_method("fast", make("Pendulum-v1", goal="reward>-0.01", feature=angle_squared)) == "pbcs"


@pytest.mark.slow
def test_the_same_seed_gives_the_same_chain_in_a_fresh_process(tmp_path):
    script = ("import sys; from pbcs_ompl.skills import train; "
              "train('pbcs/Maze-v0', method='pbcs', env_kwargs={'size': 2}, seed=5, out=sys.argv[1])")
    subprocess.run([sys.executable, "-c", script, str(tmp_path / "other")], check=True)
    mine = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=5)
    other = SkillChain.load(tmp_path / "other" / "chain")
    model = make("pbcs/Maze-v0", MAZE)
    np.testing.assert_array_equal(mine.chain.rollout(model, model.initial_state(0)),
                                  other.rollout(model, model.initial_state(0)))


class StopAfter:
    """A Ctrl-C at the n-th report of the training phase."""

    def __init__(self, count):
        self.left = count

    def __call__(self, numbers):
        self.left -= numbers["phase"] == "train"
        if not self.left:
            raise KeyboardInterrupt


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_a_training_that_was_stopped_or_killed_resumes_bit_for_bit(tmp_path, number):
    """A Ctrl-C may happen anywhere within a step, which is finished first; a kill goes back to the last checkpoint."""
    whole = train("pbcs/Maze-v0", method="pbcs", env_kwargs={"size": 3}, seed=1)
    script = ("import sys; from pbcs_ompl.skills import train, training; "
              "training.CHECKPOINT_SECONDS = training.FIRST_CHECKPOINT_SECONDS = 0.05; "
              f"train('pbcs/Maze-v0', method='pbcs', env_kwargs={{'size': 3}}, seed=1, out={str(tmp_path / 'run')!r}, "
              "on_progress=lambda numbers: print(numbers, flush=True))")
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                             text=True)
    for line in child.stdout:
        if "'train'" in line and "'skills': 0" not in line and (tmp_path / "run" / "checkpoint.npz").is_file():
            break
    assert child.poll() is None
    child.send_signal(number)
    child.communicate(timeout=60)
    assert not (tmp_path / "run" / "result.json").exists()
    assert fingerprint(resume(tmp_path / "run")) == fingerprint(whole)


@pytest.mark.parametrize(("method", "budget"), [("pbcs", 10_000_000), ("pb", 20_000), ("backplay", 20_000),
                                                ("plain", 30_000),
                                                pytest.param("bootstrapped", 60_000, marks=pytest.mark.slow),
                                                pytest.param("offline", 30_000, marks=pytest.mark.slow)])
def test_an_interrupted_training_resumes_bit_for_bit(tmp_path, method, budget):
    options = {"env_kwargs": MAZE, "seed": 1, "method": method, "max_transitions": budget}
    whole = train("pbcs/Maze-v0", **options)
    with pytest.raises(KeyboardInterrupt):
        train("pbcs/Maze-v0", **options, out=tmp_path / "run", on_progress=StopAfter(3))
    for stop in (1, 2):
        with pytest.raises(KeyboardInterrupt):
            resume(tmp_path / "run", on_progress=StopAfter(stop))
    result = resume(tmp_path / "run")
    assert fingerprint(result) == fingerprint(whole)
    assert (tmp_path / "run" / "checkpoint.npz").exists() == (not result.complete)


@pytest.mark.slow
def test_a_stop_while_a_link_is_trained_again_resumes_bit_for_bit(tmp_path):
    """An impossible standard of verification keeps the chain open until the budget ends."""
    options = {"method": "pbcs", "env_kwargs": MAZE, "seed": 2, "max_transitions": 150_000,
               "settings": {"verify": True, "epsilon": 0.9, "test_epsilon": 0.0}}
    first = train("pbcs/Maze-v0", **options)
    with pytest.raises(KeyboardInterrupt):
        train("pbcs/Maze-v0", **options, out=tmp_path / "run", on_progress=StopAfter(60))
    second = resume(tmp_path / "run")
    assert not first.complete
    assert (first.train_transitions, first.updates) == (second.train_transitions, second.updates)


def test_a_budget_ends_a_training_with_what_was_learnt_and_a_larger_one_continues(tmp_path):
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=0, max_transitions=3000, out=tmp_path / "run")
    assert (result.solved, result.complete, result.nominal) == (False, False, None)
    assert "budget of 3000" in result.reason
    assert result.trajectory is not None
    assert (tmp_path / "run" / "result.json").is_file()
    assert resume(tmp_path / "run", max_transitions=10_000_000).solved


def test_a_goal_that_the_planner_does_not_reach_is_the_reason(tmp_path):
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=0, max_transitions=50, out=tmp_path / "run")
    assert (result.solved, result.chain) == (False, None)
    assert "no path to the goal" in result.reason


def test_a_chain_that_misses_the_criterion_says_by_how_much():
    impossible = {"robust_epsilon": 1.0, "robust_episodes": 20, "verify": False}
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=0, settings=impossible)
    assert (result.solved, result.complete, result.robust.episodes) == (False, True, 20)
    assert result.reason == (f"{result.robust.successes} of 20 executions with 100% random actions succeed, "
                             "expected 95%")


def test_the_plain_agent_does_not_need_a_plan():
    result = train("pbcs/Maze-v0", env_kwargs=MAZE, method="plain", max_transitions=6000)
    assert result.plan_transitions == 0
    assert result.train_transitions >= 6000


def test_the_thesis_preset_trains_with_its_own_networks_and_order():
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, preset="thesis", max_transitions=4000, seed=0,
                   agent_settings={"hidden": [32, 32]})
    assert result.updates > 0
    assert len(result.waypoints) == result.trajectory.length + 1


def test_a_plan_made_before_is_used():
    found = plan("pbcs/Maze-v0", "Ex", env_kwargs=MAZE, seed=3)
    result = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=3, trajectory=found.trajectory)
    assert result.solved
    assert result.plan_transitions == 0
    with pytest.raises(Mismatch):
        train("pbcs/Maze-v0", method="pbcs", env_kwargs={"size": 3}, trajectory=found.trajectory)


def test_the_planner_can_be_chosen_and_the_folder_says_which(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=0, planner="KPIECE1",
              planner_kwargs={"control_duration": 2}, out=tmp_path / "run", on_progress=StopAfter(1))
    config = read_toml(tmp_path / "run" / "config.toml")
    assert (config["planner"], config["planner_kwargs"]) == ("KPIECE1", {"control_duration": 2})
    found = Trajectory.load(tmp_path / "run" / "trajectory.npz")
    assert found.planner == "KPIECE1"
    for planner in ("KPIECE1", "Ex"):
        with pytest.raises(InvalidOption, match="remove planner"):
            train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, trajectory=found, planner=planner)
    with pytest.raises(InvalidOption, match="remove trajectory"):
        train("pbcs/Maze-v0", env_kwargs=MAZE, trajectory=found, method="plain")
    with pytest.raises(KeyboardInterrupt):
        resume(tmp_path / "run", on_progress=StopAfter(1))


@pytest.mark.parametrize(("options", "error", "hint"), [
    ({"agent": "dpg"}, UnknownName, "did you mean 'ddpg'"),
    ({"method": "pbsc"}, UnknownName, "did you mean 'pbcs'"),
    ({"preset": "slow"}, UnknownName, "preset"),
    ({"planner": "Exx"}, UnknownName, "did you mean 'Ex'"),
    ({"planner_kwargs": {"hld": 10}}, InvalidOption, "no option 'hld'"),
    ({"method": "plain", "planner": "RRTNH"}, InvalidOption, "without a plan"),
    ({"method": "plain", "planner": "Ex"}, InvalidOption, "without a plan"),
    ({"method": "plain", "settings": {"alpha": 3}}, InvalidOption, "'alpha'; it is a setting of pbcs"),
    ({"seed": -1}, InvalidOption, "seed"),
    ({"settings": {"bta": 3}}, InvalidOption, "did you mean 'beta'"),
    ({"agent_settings": {"discont": 0.5}}, InvalidOption, "did you mean 'discount'"),
    ({"agent_settings": {"discount": 1.0}}, InvalidOption, "discount"),
    ({"max_transitions": 0}, InvalidOption, "max_transitions"),
])
def test_wrong_options_are_named_before_a_folder_is_made(options, error, hint, tmp_path):
    with pytest.raises(error, match=hint):
        train("pbcs/Maze-v0", env_kwargs=MAZE, out=tmp_path / "run", **{"method": "pbcs"} | options)
    assert not (tmp_path / "run").exists()


def test_a_search_that_used_up_its_budget_is_continued_with_a_larger_one(tmp_path):
    short = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=1, max_transitions=50, out=tmp_path / "run")
    assert (short.complete, short.plan_transitions) == (False, 50)
    longer = resume(tmp_path / "run", max_transitions=1_500)
    whole = train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=1, max_transitions=1_500)
    assert (longer.plan_transitions, longer.train_transitions, longer.reason) == (
        whole.plan_transitions, whole.train_transitions, whole.reason)
    assert longer.train_transitions > 0


def test_folders_are_never_overwritten_and_damage_is_named(tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("years of work")
    with pytest.raises(RunFolderError, match="already exists"):
        train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, out=tmp_path / "full")
    with pytest.raises(RunFolderError, match="nothing to resume"):
        resume(tmp_path / "absent")
    train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, out=tmp_path / "finished")
    with pytest.raises(RunFolderError, match="has ended"):
        resume(tmp_path / "finished")
    with pytest.raises(KeyboardInterrupt):
        train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, seed=1, out=tmp_path / "run", on_progress=StopAfter(3))
    checkpoint = tmp_path / "run" / "checkpoint.npz"
    checkpoint.write_bytes(checkpoint.read_bytes()[:1000])
    with pytest.raises(DamagedFile, match="checkpoint"):
        resume(tmp_path / "run")


@pytest.mark.parametrize("healthy", [0, 1000])
def test_an_exception_of_the_environment_is_named(healthy):
    """In the replay of the trajectory, and while training."""
    found = plan("pbcs/Maze-v0", "Ex", env_kwargs=MAZE, seed=3)
    model = make("pbcs/Maze-v0", MAZE)
    transition, calls = model.transition, []

    def broken(states, controls):
        calls.append(len(states))
        if len(calls) > healthy:
            raise ZeroDivisionError("physics")
        return transition(states, controls)

    model.transition = broken
    with pytest.raises(CallbackFailed, match="physics"):
        train(model, method="pbcs", trajectory=found.trajectory)


@pytest.mark.slow
@pytest.mark.parametrize("size", [3, 4, 5])
def test_pbcs_solves_every_small_maze(size, record_property):
    seeds = 20
    mazes = [{"size": size, "maze_seed": seed} if size > 3 else {"size": size} for seed in range(seeds)]
    solved = sum(train("pbcs/Maze-v0", method="pbcs", env_kwargs=maze, seed=seed).solved
                 for seed, maze in enumerate(mazes))
    record_property("solve_rate", ["PBCS", f"{size}x{size}", solved, seeds])
    # Seed 5 of size 4 has 94 of 100. In 5,000 executions its chain succeeds in 97.7 % [97.2, 98.0], less than the
    # 98.5 % that it was verified at; a chain of that rate misses 95 of 100 with a probability of 3 %.
    assert solved >= seeds - 1


@pytest.mark.parametrize(("successes", "believed", "untrue"), [(94, 0.98, False), (90, 1.0, True), (50, 0.98, True)])
def test_a_model_is_called_untrue_only_where_both_samples_say_so(successes, believed, untrue):
    nominal = Evaluation(1.0, wilson(1, 1), 1, 20.0, 0.0, {"goal": 1})
    robust = Evaluation(successes / 100, wilson(successes, 100), 100, 20.0, 0.1, {"goal": successes})
    outcome = Outcome(None, nominal, robust, believed)
    assert outcome.is_believed != untrue
    reason = failure(outcome, CriterionSettings())
    assert reason is not None
    assert reason.startswith(f"{successes} of 100 executions with 10% random actions succeed, expected 95%")
    assert ("not true" in reason) == untrue
    cut = replace(robust, endings={"goal": successes, "truncated": 100 - successes})
    again = failure(outcome._replace(robust=cut), CriterionSettings())
    assert again is not None
    assert "not true" not in again
    assert ("limit of steps" in again) == untrue
