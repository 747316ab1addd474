"""The settings that every algorithm has; each adds its own in a subclass of `AgentSettings`."""

from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any, ClassVar, Self

from pbcs_ompl.agents.presets import make_settings, preset
from pbcs_ompl.core.errors import InvalidOption


@dataclass(frozen=True)
class AgentSettings:
    """Settings of any algorithm; the values are those of the preset "fast".

    Attributes:
        algorithm: The name of the algorithm's table in the files of presets.
        hidden: Widths of the hidden layers of actor and critic.
        layer_norm: Normalise the hidden layers.
        polyak: Share of a target network that stays in each update (1 - tau).
        replay_capacity: Transitions of each seed that are kept.

    Raises:
        InvalidOption: a value out of its range.
    """

    algorithm: ClassVar[str]

    hidden: tuple[int, ...] = (64, 64)
    layer_norm: bool = False
    actor_learning_rate: float = 1e-3
    critic_learning_rate: float = 1e-3
    batch_size: int = 100
    discount: float = 0.9
    polyak: float = 0.995
    replay_capacity: int = 1_000_000

    def __post_init__(self) -> None:
        if isinstance(self.hidden, list):
            object.__setattr__(self, "hidden", tuple(self.hidden))
        for field in fields(self):
            kind = type(field.default)
            self._require(field.name, _is_a(kind, getattr(self, field.name)), f"a value of the kind {kind.__name__}")
        widths = [isinstance(width, int) and width > 0 for width in self.hidden]
        self._require("hidden", bool(widths) and all(widths), "positive whole numbers")
        for name in ("actor_learning_rate", "critic_learning_rate"):
            self._require(name, getattr(self, name) > 0.0, "a positive number")
        for name in ("batch_size", "replay_capacity"):
            self._require(name, getattr(self, name) >= 1, "a positive number")
        self._require("discount", 0.0 <= self.discount < 1.0, "in [0, 1)")
        self._require("polyak", 0.0 <= self.polyak <= 1.0, "in [0, 1]")

    def _require(self, name: str, holds: bool, expected: str) -> None:
        if not holds:
            raise InvalidOption(f"{name} is {getattr(self, name)!r}, expected {expected}")

    @classmethod
    def from_preset(cls, name: str, **changes: Any) -> Self:
        """Return the settings of a preset, some of them changed.

        Raises:
            UnknownName: no such preset.
            InvalidOption: no such setting, or a value out of its range.
        """
        return make_settings(cls, preset(name, cls.algorithm) | changes)


def _is_a(kind: type, value: Any) -> bool:
    """Tell whether a value may stand where one of this kind is expected: a whole number for any number, too."""
    wider: dict[type, type] = {float: Real, int: Integral}
    return isinstance(value, wider.get(kind, kind)) and isinstance(value, bool) == (kind is bool)
