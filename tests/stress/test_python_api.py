"""Odd values as arguments of the public functions: each call works or raises a named error, none anything else.

    python -m pytest -m slow tests/stress/test_python_api.py
"""

import math
import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from stress.forked import NAMED, call, named
from stress.others_results import POINT

import pbcs_ompl
from pbcs_ompl.core.errors import CallbackFailed
from pbcs_ompl.skills import RobotFollower, evaluate_follower, load_chain, resume_follower, train_follower
from pbcs_ompl.skills.path_following.chain import FollowChain

CALLS, SEED = 400, 20261127
MAZE, SMALL = "pbcs/Maze-v0", {"size": 2}
CHAIN, FOLLOWER = Path("chain"), Path("follower")


class Unspeakable:
    """Cannot be shown, compared or hashed."""

    def __repr__(self):
        raise RuntimeError("no words")

    __str__ = __repr__
    __eq__ = __repr__
    __hash__ = None


def raising(*_, **__):
    raise ValueError("of a callback")


VALUES = {
    "None": None, "True": True, "minus one": -1, "zero": 0, "1e18": 10**18, "2**70": 2**70, "1.5": 1.5,
    "nan": math.nan, "inf": math.inf, "empty": "", "word": "x", "null byte": "a\0b", "surrogate": "\ud800",
    "bytes": b"x",
    "list": [], "list of None": [None], "nested": [[[]]], "dict": {}, "odd dict": {1: None}, "bad dict": {"size": None},
    "nan dict": {"size": math.nan}, "object": object(), "unspeakable": Unspeakable(), "function": raising, "class": int,
    "array": np.zeros((2, 2)), "complex": 1j, "numpy int": np.int64(3), "path": Path("nowhere"), "set": {1},
}
PLAN = {"env": MAZE, "env_kwargs": SMALL, "max_transitions": 500}
TRAIN = {"env": MAZE, "env_kwargs": SMALL, "max_transitions": 600}
COMPARE = {"planners": ["Ex"], "env": MAZE, "env_kwargs": SMALL, "seeds": 1, "max_transitions": 300}
FOLLOW = {"env": MAZE, "env_kwargs": SMALL, "settings": POINT, "agent_settings": {"hidden": [32, 32]},
          "max_transitions": 19000}
OPEN = ("goal", "feature", "start_seed", "reset_options", "max_episode_steps")
FUNCTIONS = {
    "plan": (pbcs_ompl.plan, PLAN, ("planner", "planner_kwargs", *OPEN, "seed", "max_seconds", "out", "coverage",
                                    "on_progress")),
    "train": (pbcs_ompl.train, TRAIN, ("trajectory", "method", "agent", "preset", "settings", "agent_settings",
                                       "planner", "planner_kwargs", "goal", "feature", "start_seed", "seed",
                                       "device", "out", "on_progress")),
    "resume": (pbcs_ompl.resume, {"folder": "nowhere"}, ("max_transitions", "on_progress")),
    "evaluate": (pbcs_ompl.evaluate, {"controller": CHAIN, "episodes": 3}, ("env", "env_kwargs", "goal", "feature",
                                                                           "start_seed", "epsilon", "seed")),
    "compare": (pbcs_ompl.compare, COMPARE, ("goal", "feature", "start_seed", "max_seconds", "max_memory", "jobs",
                                             "out", "on_progress")),
    "make": (pbcs_ompl.make, {"env": MAZE, "env_kwargs": SMALL}, OPEN),
    "check_resettable": (pbcs_ompl.check_resettable, {"env": MAZE, "env_kwargs": SMALL}, (*OPEN[:3], "seed")),
    "run_study": (pbcs_ompl.run_study, {"study": "nowhere", "out": "study"}, ("seeds", "jobs", "max_seconds",
                                                                              "max_memory", "on_progress")),
    "write_report": (pbcs_ompl.write_report, {"folder": "."}, ("out",)),
    "EnvSpec": (pbcs_ompl.EnvSpec, {"id": MAZE, "kwargs": SMALL}, OPEN),
    "Trajectory.load": (pbcs_ompl.Trajectory.load, {"path": "nowhere.npz"}, ()),
    "SkillChain.load": (pbcs_ompl.SkillChain.load, {"folder": "nowhere"}, ()),
    "load_chain": (load_chain, {"folder": "nowhere"}, ("trust",)),
    "FollowChain.load": (FollowChain.load, {"folder": "nowhere"}, ("trust",)),
    "RobotFollower.load": (RobotFollower.load, {"folder": "nowhere"}, ("trust",)),
    "RobotFollower.shipped": (RobotFollower.shipped, {"name": "ant"}, ()),
    "train_follower": (train_follower, FOLLOW, ("worlds", "settings", "agent_settings", "seed", "out", "on_progress")),
    "resume_follower": (resume_follower, {"folder": "nowhere"}, ("max_transitions", "trust", "on_progress")),
    "evaluate_follower": (evaluate_follower, {"follower": FOLLOWER, "env": MAZE, "env_kwargs": SMALL, "episodes": 3},
                          ("trajectory", "epsilon", "seed")),
}
ENDLESS = {("train_follower", "max_transitions", value) for value in ("1e18", "2**70")}
"""Calls that do what they say: such a training ends when its budget is used up."""
CASES = [(name, slot, value) for name, (_, base, more) in FUNCTIONS.items() for slot in (*base, *more)
         for value in VALUES if (name, slot, value) not in ENDLESS]


@pytest.fixture(scope="module")
def chain():
    trained = pbcs_ompl.train(MAZE, env_kwargs=SMALL, seed=0)
    assert trained.chain is not None
    return trained.chain


@pytest.fixture(scope="module")
def follower():
    return train_follower(**FOLLOW).follower


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_odd_arguments_meet_named_errors(chain, follower, tmp_path):
    found, raw = Counter(), []
    for name, slot, value in random.Random(SEED).sample(CASES, min(CALLS, len(CASES))):
        function, base, _ = FUNCTIONS[name]
        arguments = base | {slot: VALUES[value]}
        arguments = {key: chain if one is CHAIN else follower if one is FOLLOWER else one
                     for key, one in arguments.items()}
        ended = call(named(lambda f=function, a=arguments: f(**a)), seconds=60, folder=tmp_path)
        found[ended.status] += 1
        if ended.status != NAMED:
            raw.append(f"{name}({slot}={value}): status {ended.status}: {ended.text[-600:]}")
    print(f"{len(CASES)} possible calls; {dict(found)}")
    assert not raw, f"{len(raw)} of {sum(found.values())}:\n" + "\n".join(raw)


@pytest.mark.parametrize("function", [pbcs_ompl.plan, pbcs_ompl.train])
def test_an_exception_of_on_progress_is_named(function):
    with pytest.raises(CallbackFailed, match="raised ValueError: of a callback"):
        function(MAZE, env_kwargs=SMALL, on_progress=raising)
