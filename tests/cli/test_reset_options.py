"""`--reset-options`: what every reset of a run gets as `options`."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.cli import main
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.results.command_line import environment_words
from pbcs_ompl.results.files import read_toml


class NeedsOptions(gymnasium.Env[Any, Any]):
    action_space = gymnasium.spaces.Box(-0.1, 0.1, (2,), np.float32)
    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.p = np.array((options or {})["start"], dtype=np.float32)
        return self.p.copy(), {}

    def step(self, action: Any) -> Any:
        self.p = np.clip(self.p + action, -1.0, 1.0).astype(np.float32)
        won = bool((self.p > 0.5).all())
        return self.p.copy(), float(won), won, False, {"is_success": won}


class NeedsOptionsAndRestores(NeedsOptions):
    def get_env_state(self) -> Any:
        return self.p.copy()

    def set_env_state(self, state: Any) -> None:
        self.p = np.array(state, dtype=np.float32)


@pytest.fixture(params=[NeedsOptions, NeedsOptionsAndRestores])
def env_id(request: pytest.FixtureRequest) -> Any:
    gymnasium.register("NeedsOptions-v0", request.param)
    yield "NeedsOptions-v0"
    gymnasium.registry.pop("NeedsOptions-v0")


def test_plan_and_doctor_give_them_to_every_reset(env_id: str, tmp_path: Path) -> None:
    words = ["--env", env_id, "--reset-options", '{"start": [0.25, 0.25]}']
    assert main(["plan", *words, "--max-transitions", "20000", "--out", str(tmp_path / "run")]) == 0
    assert main(["doctor", *words]) == 0
    spec = EnvSpec.from_dict(read_toml(tmp_path / "run" / "config.toml")["environment"])
    assert spec.reset_options == {"start": [0.25, 0.25]}
    assert "--reset-options" in environment_words(spec)
