"""doctor, plan, train, eval and report, each in a process of its own, for one environment of every adapter family."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ENVIRONMENTS = '''
import gymnasium, numpy as np

class Simple(gymnasium.Env):
    """The simplest way: two methods, bounds, and `is_success`."""
    action_space = gymnasium.spaces.Box(-0.1, 0.1, (2,), np.float64)
    observation_space = gymnasium.spaces.Box(-1, 1, (2,), np.float64)
    state_low, state_high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = np.full(2, -0.2)
        return self.place.copy(), {}

    def step(self, action):
        self.place = np.clip(self.place + np.clip(action, -0.1, 0.1), -1, 1)
        success = bool(np.hypot(*(self.place - 0.2)) < 0.15)
        return self.place.copy(), float(success), success, False, {"is_success": success}

    def get_env_state(self):
        return self.place.copy()

    def set_env_state(self, state):
        self.place = np.array(state)

class Slider(gymnasium.Env):
    """Keeps its state where no adapter looks for it: it can only be copied."""
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float64)
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.hidden = {"place": 0.0, "speed": 0.0}
        return np.zeros(2), {}

    def step(self, action):
        self.hidden["speed"] = 0.9 * self.hidden["speed"] + 0.05 * float(action[0])
        self.hidden["place"] += self.hidden["speed"]
        done = self.hidden["place"] > 0.2
        return np.array([self.hidden["place"], self.hidden["speed"]]), float(done), done, False, {}

class Uncopyable(Slider):
    """Cannot even be copied: its actions are made again."""
    def __deepcopy__(self, memo):
        raise TypeError("no")

gymnasium.register("Simple-v0", "families:Simple", max_episode_steps=100)
gymnasium.register("Copied-v0", "families:Slider", max_episode_steps=100)
gymnasium.register("Replayed-v0", "families:Uncopyable", max_episode_steps=100)
'''
FAMILIES = {
    "vectorised": ["--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}'],
    "get and set": ["--env", "families:Simple-v0"],
    "mujoco": ["--env", "InvertedPendulum-v5", "--goal", "qpos[0]>=0.02"],
    "classic control": ["--env", "Pendulum-v1", "--goal", "obs[0]<=-0.5", "--start-seed", "1"],
    "copied": ["--env", "families:Copied-v0"],
    "replayed": ["--env", "families:Replayed-v0"],
}


@pytest.mark.parametrize("family", [pytest.param(family, marks=[] if family == "get and set" else [pytest.mark.slow])
                                    for family in FAMILIES])
def test_every_step_works_in_a_new_process(family: str, tmp_path: Path) -> None:
    if family == "mujoco":
        pytest.importorskip("mujoco")
    (tmp_path / "families.py").write_text(ENVIRONMENTS)
    env = FAMILIES[family]

    def pbcs(*words: str) -> tuple[int, dict[str, object]]:
        done = subprocess.run([sys.executable, "-m", "pbcs_ompl.cli", *words, "--json"], cwd=tmp_path,
                              capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        assert "Traceback" not in done.stderr
        return done.returncode, json.loads(done.stdout.splitlines()[-1])

    status, found = pbcs("doctor", *env)
    assert status == 0, found["environment"]
    status, found = pbcs("plan", *env, "--seed", "1", "--out", "plan")
    assert (status, found["replay_ok"]) == (0, True)
    # `train` reads the plan of the other process, and has time for some updates, not for a solution in every family.
    status, found = pbcs("train", *env, "--path", "plan", "--max-transitions", "3000", "--out", "chain",
                         "--settings", '{"radius": 0.3}')
    assert found["plan_transitions"] == 0
    if (tmp_path / "chain" / "chain").is_dir():
        assert pbcs("eval", "chain", "--trust", "--episodes", "2", "--out", "evaluation")[1]["episodes"] == 2
    status, found = pbcs("report", ".")
    assert found["damaged"] == {}
