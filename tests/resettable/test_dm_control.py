"""Environments of dm_control's suite, through shimmy: MuJoCo, whose model and data are one step further in."""

from typing import Any

import gymnasium
import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("dm_control")
pytest.importorskip("shimmy")

from pbcs_ompl.resettable import check_resettable, make
from pbcs_ompl.resettable.adapters.mujoco import MujocoEnv
from pbcs_ompl.resettable.simulation import holds_compiled_model, simulation_of


@pytest.mark.parametrize("env_id", ["dm_control/pendulum-swingup-v0", "dm_control/hopper-hop-v0",
                                    "dm_control/point_mass-hard-v0"])
def test_the_suite_is_restored_as_mujoco(env_id: str) -> None:
    model: Any = make(f"shimmy:{env_id}", goal="reward>0.5")
    assert isinstance(model.env, MujocoEnv)
    report = check_resettable(model)
    assert report.ok, str(report)


@pytest.mark.parametrize("options", [{"flat_observation": True}, {"legacy_step": False}])
def test_options_that_change_what_is_computed_when(options: dict[str, Any]) -> None:
    model = make("shimmy:dm_control/walker-run-v0", {"environment_kwargs": options})
    report = check_resettable(model)
    assert report.ok, str(report)


def test_a_restored_state_continues_as_the_environment_itself() -> None:
    model: Any = make("shimmy:dm_control/cheetah-run-v0")
    raw = gymnasium.make("dm_control/cheetah-run-v0")
    raw.reset(seed=3)
    state, rng = model.initial_state(3), np.random.default_rng(0)
    for _ in range(30):
        action = rng.uniform(-1.0, 1.0, raw.action_space.shape)
        observation, reward, *_ = raw.step(action)
        outcome = model.transition(state[None], action[None])
        state = outcome.states[0]
        np.testing.assert_array_equal(model.observe(state[None])[0],
                                      np.concatenate([observation[key].ravel() for key in sorted(observation)]))
        assert outcome.rewards[0] == reward


def test_models_that_each_reset_compiles_are_not_taken_for_constant() -> None:
    env = gymnasium.make("dm_control/reach_site_features-v0").unwrapped
    assert simulation_of(env) is None
    assert holds_compiled_model(env)
