"""All that a MuJoCo environment changes is restored: controls, forces, the model, its options, and what lags behind."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco")

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.resettable import adapt, check_resettable
from pbcs_ompl.resettable.adapters.restorable import GUARD_EVERY
from pbcs_ompl.resettable.branching import LONG, first_difference
from tests.resettable.toys import Cart, walk


class Servo(Cart):
    """Actions move the set point of a servo."""

    actuator = "position", 'kp="40"'

    def push(self, action: float) -> None:
        self.data.ctrl[0] = np.clip(self.data.ctrl[0] + 0.05 * action, -1, 1)


class Pushed(Cart):
    """Forces that stay."""

    def push(self, action: float) -> None:
        self.data.qfrc_applied[0] += action
        self.data.xfrc_applied[1, 0] += 0.5 * action


class Geared(Cart):
    """Each episode has a gear and a friction of its own."""

    def begin(self) -> None:
        self.model.actuator_gear[0, 0] = self.np_random.uniform(1, 9)
        self.model.geom_friction[0] = self.np_random.uniform(0.1, 1)


class Tilted(Cart):
    """Steps turn gravity."""

    def begin(self) -> None:
        self.model.opt.gravity[:] = [0, 0, -9.81]

    def push(self, action: float) -> None:
        self.model.opt.gravity[0] += action
        self.model.opt.viscosity = abs(self.model.opt.gravity[0])


class Painted(Cart):
    """Colour is state where the reward depends on it."""

    def begin(self) -> None:
        self.model.geom_rgba[:, 0] = 0.5

    def push(self, action: float) -> None:
        super().push(action)
        self.model.geom_rgba[0, 0] = np.clip(self.model.geom_rgba[0, 0] + 0.1 * action, 0, 1)

    def reward(self) -> float:
        return float(self.model.geom_rgba[0, 0])


class Mocap(Cart):
    """A body that actions move, and a damping that follows it."""

    def push(self, action: float) -> None:
        self.data.mocap_pos[0, 0] += 0.1 * action
        self.data.ctrl[0] = self.data.mocap_pos[0, 0]


class Lagging(Cart):
    """The reward is the speed of the body as MuJoCo's positions have it, which are those of the step before."""

    def push(self, action: float) -> None:
        self.before = float(self.data.xpos[1, 0])
        super().push(action)

    def reward(self) -> float:
        return float(self.data.xpos[1, 0]) - self.before


@pytest.mark.parametrize("kind", [Cart, Servo, Pushed, Geared, Tilted, Painted, Mocap, Lagging])
def test_branches_are_what_fresh_instances_do(kind: type[Cart]) -> None:
    model: Any = adapt(kind())
    assert first_difference(model.env, kind, steps=LONG, seed=1) == ""
    report = check_resettable(model)
    assert report.ok, str(report)


def test_what_a_state_lacks_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from pbcs_ompl.resettable.adapters.mujoco_state import ModelParts

    monkeypatch.setattr(ModelParts, "look", lambda *_, **__: None)
    monkeypatch.setattr(ModelParts, "check", lambda *_: None)
    with pytest.raises(NotResettable, match=r"differs in (state: \w+|observation)\[0\] at step"):
        adapt(Tilted())


def test_a_model_that_changes_late_is_refused_by_name() -> None:
    class Late(Cart):
        def push(self, action: float) -> None:
            super().push(action)
            if self.data.qpos[0] > 3.0:
                self.model.body_mass[1] = 2.0

    with pytest.raises(NotResettable, match=r"model\.body_mass has changed"):
        walk(Late, 2 * GUARD_EVERY, 1.0)


def test_two_simulations_are_refused() -> None:
    class Two(Cart):
        def __init__(self) -> None:
            import mujoco

            super().__init__()
            self.dreamed = mujoco.MjData(self.model)

        def push(self, action: float) -> None:
            import mujoco

            mujoco.mj_step(self.model, self.dreamed)
            self.data.ctrl[0] = action + self.dreamed.time

    with pytest.raises(NotResettable, match="keeps a MjData in its attribute 'dreamed'"):
        adapt(Two())
