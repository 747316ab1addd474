"""Laws of plan(): true answers with their evidence, every mistake one named error, nothing half-written."""

import gc
import json
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from itertools import pairwise

import numpy as np
import pytest
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.bridge.tree import load_tree
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import (
    CallbackFailed,
    InvalidOption,
    InvalidState,
    NotResettable,
    PbcsError,
    RunFolderError,
    UnknownName,
)
from pbcs_ompl.resettable import make
from pbcs_ompl.results.files import read_toml

MAZE = "pbcs/Maze-v0"
SUMMARY = ["solved", "found", "reason", "transitions", "collision_checks", "seconds", "nodes", "path_length",
           "replay_ok", "planner", "env", "seed", "out"]
FILES = [".sha256", "config.toml", "provenance.json", "result.json", "trajectory.npz", "tree.npz"]
STOCK = [oc.RRT, oc.EST, oc.KPIECE1]


class FirstStep(ob.Planner):
    """Propagates random controls from the start; what it claims is decided by `claim`."""

    def __init__(self, si, claim="nothing", steps=5, seed=0):
        if steps < 1:
            raise ValueError(f"steps={steps}")
        super().__init__(si, "FirstStep")
        self.claim, self.steps, self.seed = claim, steps, seed
        self.tree = ["a user's own idea of a tree"]

    def solve(self, ptc):
        if self.claim == "raise":
            raise ZeroDivisionError("a broken planner")
        si, path = self.getSpaceInformation(), oc.PathControl(self.getSpaceInformation())
        state, after, control = si.allocState(), si.allocState(), si.allocControl()
        si.copyState(state, self.getPlannerInputStates().nextStart())
        for _ in range(self.steps):
            if ptc():
                break
            control[0], control[1] = 0.1, 0.1
            si.propagate(state, control, 1, after)
            path.append(state, control, 1.0)
            si.copyState(state, after)
        path.append(state)
        if self.claim == "approximate":
            self.getProblemDefinition().addSolutionPath(path, True, 1.0)
        if self.claim == "exact":
            self.getProblemDefinition().addSolutionPath(path)
        return ob.PlannerStatus(self.claim != "nothing", self.claim == "approximate")


@pytest.mark.parametrize("planner", ["Ex", *STOCK])
def test_plan_solves_a_maze_and_leaves_its_evidence(planner, tmp_path):
    out = tmp_path / "run"
    result = plan(MAZE, planner, env_kwargs={"size": 3}, seed=1, out=out)
    assert result.solved
    assert result.replay_ok
    assert list(result.summary()) == SUMMARY
    assert json.loads((out / "result.json").read_text()) == result.summary()
    config = read_toml(out / "config.toml")
    assert (config["kind"], config["environment"]["id"], config["seed"]) == ("plan", MAZE, 1)
    assert config["environment"]["kwargs"]["size"] == 3
    assert config["versions"]["ompl"]
    trajectory, tree = Trajectory.load(out / "trajectory.npz"), load_tree(out / "tree.npz")
    model = make(MAZE, {"size": 3})
    trajectory.check_belongs_to(model)
    assert trajectory.replays_exactly(model)
    assert trajectory.length == result.path_length
    assert model.goal_distance(trajectory.states)[-1] < model.goal_threshold
    assert len(tree.states) == result.nodes
    assert sorted(path.name for path in out.iterdir()) == FILES


@pytest.mark.parametrize("planner", ["Ex", *STOCK])
def test_tree_is_one_tree_and_holds_the_path(planner):
    result = plan(MAZE, planner, env_kwargs={"size": 3}, seed=2)
    tree, path, model = result.tree, result.trajectory.states, make(MAZE, {"size": 3})
    assert (tree.parents < 0).sum() == 1
    children = np.flatnonzero(tree.parents >= 0)
    before, after = tree.states[tree.parents[children]], tree.states[children]
    edges = {(one.tobytes(), other.tobytes()) for one, other in zip(before, after, strict=True)}
    assert {(one.tobytes(), other.tobytes()) for one, other in pairwise(path)} <= edges
    if tree.has_controls:
        assert np.array_equal(model.transition(before, tree.controls[children]).states, after)


def test_budget_ends_an_unreachable_goal_and_the_tree_is_saved(square, tmp_path):
    for planner in ("Ex", *STOCK):
        name = planner if isinstance(planner, str) else planner.__name__
        result = plan(square(goal=9.0), planner, max_transitions=2_000, out=tmp_path / name)
        assert (result.solved, result.transitions) == (False, 2_000)
        assert (result.path_length, result.replay_ok, result.trajectory) == (None, None, None)
        assert len(load_tree(tmp_path / name / "tree.npz").states) == result.nodes > 100
        assert not (tmp_path / name / "trajectory.npz").exists()


def test_time_ends_too(square):
    result = plan(square(goal=9.0), oc.KPIECE1, max_seconds=0.1, max_transitions=10**9)
    assert not result.solved
    assert 0 < result.transitions < 10**9


def test_no_node_comes_from_a_refused_step(square):
    model = square(size=3, goal=9.0)
    for planner in STOCK:
        tree = plan(model, planner, max_transitions=500).tree
        children = np.flatnonzero(tree.parents >= 0)
        assert np.array_equal(tree.states[children, 2], tree.states[tree.parents[children], 2] + 1)


@pytest.mark.parametrize("planner", ["Ex", "RRT", *STOCK])
def test_equal_seeds_give_equal_results(planner):
    first, second, other = (plan(MAZE, planner, env_kwargs={"size": 3}, seed=seed) for seed in (0, 0, 1))
    assert first.trajectory.states.tobytes() == second.trajectory.states.tobytes()
    assert (first.transitions, first.nodes) == (second.transitions, second.nodes)
    assert first.trajectory.states.tobytes() != other.trajectory.states.tobytes()


def test_only_true_solutions_count(square):
    for claim in ("approximate", "exact", "nothing"):
        assert not plan(square(), FirstStep, planner_kwargs={"claim": claim}).solved
    result = plan(square(start=(4.0, 4.0)), FirstStep, planner_kwargs={"claim": "exact"})
    assert result.solved
    assert result.replay_ok
    assert (result.path_length, result.transitions, result.nodes) == (5, 5, 0)


def test_replay_finds_out_an_environment_that_is_not_deterministic(square):
    model = square(start=(4.0, 4.0))
    step, noise = model.step_one, np.random.default_rng(0)
    model.step_one = lambda state, control: step(state, [c + noise.normal(0, 1e-9) for c in control])
    assert plan(model, FirstStep, planner_kwargs={"claim": "exact"}).replay_ok is False


@pytest.mark.parametrize("env", ["id", "spec", "model", "gymnasium"])
def test_environment_is_given_in_four_ways(env):
    import gymnasium

    model = make(MAZE, {"size": 3})
    given = {"id": MAZE, "model": model, "spec": EnvSpec(MAZE, {"size": 3}),
             "gymnasium": gymnasium.make(MAZE, size=3)}[env]
    result = plan(given, oc.RRT, env_kwargs={"size": 3} if env == "id" else None)
    assert result.solved
    assert result.replay_ok
    assert (result.env, result.trajectory.environment.kwargs["size"]) == (MAZE, 3)


@pytest.mark.parametrize(("planner", "given", "expected"), [
    ("Ex", {}, {"bin_size": [0.15, 0.15], "batch": "grow", "control_duration": 1}),
    ("ex", {"bin_size": 0.2, "batch": 3}, {"bin_size": [0.2, 0.2], "batch": 3, "control_duration": 1}),
    ("ESTAdapted", {"distance": [0.1, 0.3]},
     {"distance": [0.1, 0.3], "rule": "draw", "batch": "grow", "control_duration": 1}),
    ("RandomWalk", {"control_duration": 2}, {"max_steps": 180, "walkers": 1, "batch": "grow", "control_duration": 2}),
    ("RRTNH", {}, {"batch": "grow", "control_duration": 1}),
    ("RRT", {"goal_bias": 0.1}, {"goal_bias": 0.1, "intermediate_states": False, "control_duration": 1}),
    (oc.KPIECE1, {}, {}),
    (FirstStep, {"steps": 2}, {"claim": "nothing", "steps": 2}),
])
def test_a_folder_holds_every_option_of_the_planner_and_repeats_the_run(planner, given, expected, tmp_path):
    maze = {"env_kwargs": {"size": 3}, "seed": 1, "max_transitions": 300}
    first = plan(MAZE, planner, planner_kwargs=given, out=tmp_path / "run", **maze)
    config = read_toml(tmp_path / "run" / "config.toml")
    assert config.get("planner_kwargs", {}) == first.planner_settings == expected
    again = plan(EnvSpec(**config["environment"]), planner if callable(planner) else config["planner"],
                 planner_kwargs=config.get("planner_kwargs", {}), seed=config["seed"],
                 max_transitions=config["max_transitions"])
    assert again.tree.states.tobytes() == first.tree.states.tobytes()
    assert again.planner_settings == first.planner_settings


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"planner": "KPEICE1"}, UnknownName, "did you mean 'KPIECE1'"),
    ({"planner": "no_such_module:Planner"}, PbcsError, "cannot load"),
    ({"planner": "json:dumps"}, InvalidOption, "is no planner"),
    ({"planner": 3}, InvalidOption, "is no planner"),
    ({"planner": oc.EST, "planner_kwargs": {"goal_bias": 1}}, InvalidOption, "takes no options"),
    ({"planner": FirstStep, "planner_kwargs": {"clam": 1}}, InvalidOption, "did you mean 'claim'"),
    ({"planner": FirstStep, "planner_kwargs": {"seed": 1}}, InvalidOption, "no option 'seed'"),
    ({"planner": FirstStep, "planner_kwargs": {"steps": 0}}, InvalidOption, "steps=0"),
    ({"planner": "Ex", "planner_kwargs": {"bin_sise": 1}}, InvalidOption, "no option 'bin_sise'"),
    ({"max_transitions": 0}, InvalidOption, "max_transitions is 0"),
    ({"max_transitions": -5}, InvalidOption, "max_transitions is -5"),
    ({"max_seconds": 0.0}, InvalidOption, "max_seconds is 0"),
    ({"max_seconds": float("nan")}, InvalidOption, "max_seconds is nan"),
    ({"env_kwargs": {"size": 0}}, InvalidOption, "size"),
    ({"env_kwargs": {"sise": 3}}, InvalidOption, "did you mean 'size'"),
    ({"env": "pbcs/Mase-v0"}, UnknownName, "did you mean 'pbcs/Maze-v0'"),
    ({"env": 3}, NotResettable, "expected a gymnasium.Env"),
])
def test_mistakes_are_named_and_leave_nothing_behind(tmp_path, arguments, error, message):
    with pytest.raises(error, match=message):
        plan(**{"env": MAZE, **arguments}, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_options_of_an_environment_that_is_built_already(square):
    with pytest.raises(InvalidOption, match="built already"):
        plan(square(), env_kwargs={"size": 3})


def test_start_in_a_wall(square):
    with pytest.raises(InvalidState, match="inside a wall"):
        plan(square(start=(2.1, 1.0)), oc.RRT)


@pytest.mark.parametrize("planner", ["Ex", *STOCK])
@pytest.mark.parametrize("answer", [RuntimeError("broken world"), np.nan])
def test_failing_environment(square, planner, answer, tmp_path):
    model = square()
    step = model.step_one
    count = iter(range(10**9))

    def failing(state, control):
        if next(count) < 30:
            return step(state, control)
        if isinstance(answer, Exception):
            raise answer
        return [answer] * len(state)

    model.step_one = failing
    with pytest.raises(CallbackFailed, match=r"broken world|expected finite numbers") as caught:
        plan(model, planner, out=tmp_path / "run")
    assert (caught.value.__cause__ is answer) == isinstance(answer, Exception)
    assert not (tmp_path / "run").exists()
    if isinstance(answer, Exception):
        answer.__traceback__ = None  # pytest keeps the parameter, which would keep OMPL's objects until the end


@pytest.mark.parametrize("planner", ["Ex", "RRT"])
def test_a_failed_plan_leaves_nothing_in_memory(square, planner):
    """The error is not kept by what it keeps: OMPL would hold problem, environment and tree for ever."""
    model = square()

    def failing(state, control):
        raise ZeroDivisionError("broken world")

    model.step_one = model.transition = failing
    alive = weakref.ref(model)
    with pytest.raises(CallbackFailed):
        plan(model, planner)
    del model, failing
    gc.collect()
    assert alive() is None


def test_failing_planner_and_progress(square):
    with pytest.raises(CallbackFailed, match="a broken planner"):
        plan(square(), FirstStep, planner_kwargs={"claim": "raise"})
    with pytest.raises(CallbackFailed, match="no terminal"):
        plan(square(), oc.RRT, on_progress=lambda _: (_ for _ in ()).throw(OSError("no terminal")))


def test_progress_reports_plain_numbers(square):
    reports = []
    plan(square(goal=9.0), oc.KPIECE1, max_seconds=0.6, on_progress=reports.append)
    assert 2 <= len(reports) <= 10
    assert all(json.loads(json.dumps(numbers)) == numbers for numbers in reports)
    assert [numbers["transitions"] for numbers in reports] == sorted(numbers["transitions"] for numbers in reports)


def test_folder_that_exists_is_refused_before_the_search(square, tmp_path):
    (tmp_path / "precious.txt").write_text("keep me")
    with pytest.raises(RunFolderError, match="already exists"):
        plan(square(), oc.RRT, out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["precious.txt"]


def test_full_disk_leaves_nothing_behind(square, tmp_path, monkeypatch):
    written = []
    replace = os.replace

    def full_after_two(source, target):
        written.append(target)
        if len(written) > 2:
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", full_after_two)
    with pytest.raises(RunFolderError, match="disk is full"):
        plan(square(), oc.RRT, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("planner", ["Ex", oc.KPIECE1])
def test_control_c_ends_the_search_and_leaves_nothing_behind(square, tmp_path, planner):
    def press() -> None:
        time.sleep(0.3)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press).start()
    with pytest.raises(KeyboardInterrupt):
        plan(square(goal=9.0), planner, max_transitions=10**9, max_seconds=20, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


MEMORY = """
import gc, sys
from ompl import control as oc
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.resettable import make

def resident():
    gc.collect()
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6

def main(planner):
    model = make("pbcs/Maze-v0", {"size": 5, "maze_seed": 1})
    def cycle(seed):
        assert plan(model, planner, seed=seed % 10, max_transitions=5_000).nodes > 100
    for seed in range(40):
        cycle(seed)
    before = resident()
    for seed in range(200):
        cycle(seed)
    print(resident() - before)

main(sys.argv[1])
"""


@pytest.mark.slow
@pytest.mark.parametrize("planner", ["Ex", "KPIECE1"])
def test_memory_stays_flat_over_200_plans(planner):
    command = [sys.executable, "-c", MEMORY, planner]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 5.0
    assert "leaked" not in done.stderr
