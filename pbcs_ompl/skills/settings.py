"""What can be set in skill training, and the named presets."""

import tomllib
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any

from pbcs_ompl.core.errors import InvalidOption, UnknownName, did_you_mean

ACTIVATIONS = ("ball", "classifier")


@dataclass(frozen=True)
class SkillSettings:
    """Settings of Backplay in all its forms.

    Attributes:
        alpha: Sessions without improvement after which training has stabilised (Alg. 7).
        beta: Episodes of a session and of a test (Alg. 7 and 8).
        radius: Radius of start balls, activation sets and local goals: the thesis's epsilon of section 7.2.
        activation: "ball", or "classifier": the activation set of a finished skill is learnt from what came of it in
            states around its start.
        epsilon: Share of random actions while collecting experience.
        test_epsilon: Share of random actions in tests; 0 in the thesis.
        max_steps: Longest episode of a skill.
        updates_per_transition: Gradient steps for each collected transition.
        episodes_together: Episodes that run as one batch between updates; 1 is the thesis's order.
        shaped: Train on the shaped reward instead of the environment's own.
        stop_at_success: Leave a training loop at 100 % instead of waiting for alpha sessions without improvement.
        keep_partial: Move on when a start point is only partly solved, as Alg. 7 does; else end the skill there.
        reject_invalid: Draw again when a start state is invalid; the literal rule keeps it.
        shorten: Erase detours of the plan first.
        rehearsal: Share of training episodes that start from a random point already passed.
        min_stride, max_stride: Steps along the plan between start points; the stride doubles while tests pass.
        relative_observations: Policies see (observation - goal's observation) / ten steps' movement.
        warm_start: A new skill starts from the networks of the one before.
        verify_episodes: Executions of the complete chain after which PBCS learns its weakest skill anew, if need be; 0
            for none, as in the thesis.
        window: Share of the plan that one window of the original Backplay spans.
        window_sessions: Sessions the original Backplay stays in one window.
        pretest: PB tests a new start point before training there (Fig. 5.1b).
        explored: Transitions of Ex that "bootstrapped" and "offline" begin with (section 4.4).
    """

    alpha: int = 10
    beta: int = 50
    radius: float = 0.1
    activation: str = "ball"
    epsilon: float = 0.1
    test_epsilon: float = 0.0
    max_steps: int = 50
    updates_per_transition: float = 1.0
    episodes_together: int = 1
    shaped: bool = True
    stop_at_success: bool = True
    keep_partial: bool = True
    reject_invalid: bool = True
    shorten: bool = False
    rehearsal: float = 0.0
    min_stride: int = 1
    max_stride: int = 1
    relative_observations: bool = False
    warm_start: bool = False
    verify_episodes: int = 0
    window: float = 0.1
    window_sessions: int = 10
    pretest: bool = True
    explored: int = 10_000

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "max_steps", "episodes_together", "min_stride", "max_stride",
                     "window_sessions", "explored"):
            self._require(name, getattr(self, name) >= 1, "at least 1")
        self._require("activation", self.activation in ACTIVATIONS, f"one of {', '.join(ACTIVATIONS)}")
        self._require("verify_episodes", self.verify_episodes >= 0, "at least 0")
        for name in ("epsilon", "test_epsilon", "rehearsal"):
            self._require(name, 0 <= getattr(self, name) <= 1, "within [0, 1]")
        for name in ("radius", "updates_per_transition", "window"):
            self._require(name, getattr(self, name) > 0, "greater than 0")
        self._require("max_stride", self.max_stride >= self.min_stride, f"at least min_stride = {self.min_stride}")

    def _require(self, name: str, holds: bool, expected: str) -> None:
        if not holds:
            raise InvalidOption(f"{name} = {getattr(self, name)!r}, expected {expected}")

    def updated(self, changes: dict[str, Any]) -> "SkillSettings":
        """Return a copy with some settings replaced.

        Raises:
            InvalidOption: a name that does not exist (the closest is suggested), or a value of the wrong kind.
        """
        known = {field.name: type(getattr(self, field.name)) for field in fields(self)}
        for name, value in changes.items():
            if name not in known:
                raise InvalidOption(f"unknown skill setting {name!r}{did_you_mean(name, known)}")
            wanted = known[name]
            if not isinstance(value, int | float if wanted is float else wanted) or (
                    isinstance(value, bool) and wanted is not bool):
                raise InvalidOption(f"{name} = {value!r}, expected {wanted.__name__}")
        return replace(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as plain values."""
        return asdict(self)


@cache
def _presets() -> dict[str, dict[str, Any]]:
    return tomllib.loads(files("pbcs_ompl.skills").joinpath("presets.toml").read_text())


def skill_preset(name: str, method: str = "pbcs") -> SkillSettings:
    """Return the settings that a named preset has for a method.

    Raises:
        UnknownName: no such preset.
    """
    if name not in _presets():
        raise UnknownName("preset", name, _presets())
    table = _presets()[name]
    return SkillSettings().updated(table["skills"] | table.get(method, {}))
