"""None among the options of an environment is written and comes back: TOML has no null."""

from pathlib import Path
from typing import Any

import gymnasium
import pytest

import pbcs_ompl
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.envs.box_disc import BoxEnv
from pbcs_ompl.results.files import read_toml


class Waypoints(BoxEnv):
    def __init__(self, waypoints: Any = (), limits: Any = 1.0, **options: Any):
        self.limits = limits
        super().__init__(**options)


@pytest.mark.parametrize("options", [
    {"waypoints": [None, 1.0]}, {"waypoints": [[None], {"x": None}]}, {"limits": None},
])
def test_a_plan_with_none_among_its_options_can_be_read(tmp_path: Path, options: dict[str, Any]) -> None:
    gymnasium.registry.pop("Waypoints-v0", None)
    gymnasium.register("Waypoints-v0", Waypoints)
    pbcs_ompl.plan("Waypoints-v0", "Ex", env_kwargs=options, max_transitions=100, out=tmp_path / "run")
    found = EnvSpec.from_dict(read_toml(tmp_path / "run" / "config.toml")["environment"])
    assert found.same_as(EnvSpec("Waypoints-v0", options))
