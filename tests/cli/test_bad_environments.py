"""What is not resettable, and rules that say nothing, end in one line with a remedy and the right status."""

import json
import shlex
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers

from pbcs_ompl.cli import main
from pbcs_ompl.results.files import read_arrays, write_arrays

BOX = spaces.Box(-1.0, 1.0, (1,), np.float64)
EVERYWHERE = spaces.Box(-np.inf, np.inf, (1,), np.float64)


class Slider(gymnasium.Env):
    """A point on a line that only copies can restore."""

    action_space: gymnasium.Space = BOX
    observation_space = EVERYWHERE

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.hidden = {"place": 0.0}
        return np.zeros(1), {}

    def step(self, action: Any) -> Any:
        self.hidden["place"] += 0.1 * float(action[0])
        done = self.hidden["place"] > 1.0
        return np.array([self.hidden["place"]]), float(done), done, False, {}


class Named(Slider):
    action_space = spaces.Dict(force=BOX)


class Noisy(Slider):
    def step(self, action: Any) -> Any:
        return super().step(action + np.random.default_rng().normal(size=1))


class Forgetful(Slider):
    def __deepcopy__(self, memo: Any) -> Any:
        return type(self)()


def stacked(**_: Any) -> gymnasium.Env:
    return wrappers.FrameStackObservation(Slider(), 2)


def normalised(**_: Any) -> gymnasium.Env:
    return wrappers.NormalizeObservation(Slider())


ENTRIES = {"Named": Named, "Noisy": Noisy, "Forgetful": Forgetful, "Stacked": stacked,
           "Normalised": normalised}


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, entry in ENTRIES.items():
        monkeypatch.setitem(gymnasium.registry, f"Bad{name}-v0",
                            gymnasium.envs.registration.EnvSpec(f"Bad{name}-v0", entry_point=entry))


def complaint(words: str, status: int, capsys: pytest.CaptureFixture[str]) -> str:
    """Run `pbcs`, which has to end with `status`, one line on stderr, and nothing left behind; return the line."""
    before = sorted(Path().rglob("*"))
    assert main(shlex.split(words)) == status
    captured = capsys.readouterr()
    (line,) = captured.err.splitlines()
    assert captured.out == ""
    assert sorted(Path().rglob("*")) == before
    return line


@pytest.mark.parametrize("verb", ["plan", "doctor"])
@pytest.mark.parametrize(("name", "message"), [
    ("Named", "expected a Box, Discrete, MultiDiscrete or MultiBinary; map one to these actions inside"),
    ("Noisy", "so its steps are random, or depend on what is outside of it: fresh instances differ in observation"),
    ("Stacked", "FrameStackObservation has a memory or noise that a restored state would not bring back; leave it out"),
    ("Normalised", "NormalizeObservation has a memory or noise"),
])
def test_what_cannot_be_reset(verb: str, name: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert message in complaint(f"{verb} --env Bad{name}-v0", 2, capsys)


@pytest.mark.parametrize(("rule", "message"), [
    ("--feature obs[", "does not parse at 'obs['; expected something like"),
    ("--feature obs[0:99]", "obs has 3 numbers, 0 to 2"),
    ("--feature osb[0]", "did you mean 'obs'"),
    ("--goal reward", "compares nothing; expected something like"),
    ("--goal obs[0]>>1", "expected a number after the comparison"),
    ("--goal obs[7]>1", "obs has 3 numbers, 0 to 2"),
])
def test_rules_that_say_nothing(rule: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert message in complaint(f"plan --env Pendulum-v1 {rule}", 2, capsys)


def test_a_copy_that_is_not_faithful_is_not_trusted(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(shlex.split("plan --env BadForgetful-v0 --planner Ex --max-transitions 500 --json")) == 0
    captured = capsys.readouterr()
    warnings = [line for line in captured.err.splitlines() if line.startswith("pbcs: warning: ")]
    assert warnings == [line for line in warnings if "replaying its actions, which is slow: implement" in line]
    assert json.loads(captured.out.splitlines()[-1])["replay_ok"]


def test_a_path_of_another_mujoco(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mujoco")
    assert main(shlex.split("plan --env pbcs/SparseHalfCheetah-v0 --planner Ex --out found")) == 0
    capsys.readouterr()
    arrays = read_arrays(Path("found/trajectory.npz"))
    words = json.loads(str(arrays["metadata"]))
    words["versions"]["mujoco"] = "3.3.0"
    write_arrays(Path("found/trajectory.npz"), **arrays | {"metadata": np.array(json.dumps(words))})
    line = complaint("train --method pbcs --env pbcs/SparseHalfCheetah-v0 --path found --out trained", 2, capsys)
    assert "made with mujoco 3.3.0, installed is" in line
    assert "plan again, or install that version" in line


def test_robots_that_the_installed_mujoco_cannot_run(capsys: pytest.CaptureFixture[str]) -> None:
    mujoco = pytest.importorskip("mujoco")
    pytest.importorskip("gymnasium_robotics")
    capsys.readouterr()  # it greets whoever imports it
    if tuple(map(int, mujoco.__version__.split(".")[:2])) <= (3, 8):
        pytest.skip("this mujoco runs them")
    assert "pip install 'mujoco<=3.8'" in complaint("plan --env FetchReach-v4", 3, capsys)
