"""The settings that every algorithm has, and presets: named, versioned settings as data, one TOML file for each.

Each algorithm adds its own settings in a subclass of `AgentSettings`. A preset's table [common] holds for all
algorithms, those that are called like an algorithm for that one.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from importlib.resources import files
from math import inf
from typing import Any, ClassVar, Protocol, Self

from pbcs_ompl.agents.initialisation import INITIALISATIONS
from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.core.options import check_names, check_range, check_types


def preset_names() -> list[str]:
    """Return the names of all presets, sorted."""
    entries = [entry.name for entry in files("pbcs_ompl.agents").iterdir()]
    return sorted(name.removesuffix(".toml") for name in entries if name.endswith(".toml"))


def preset_version(name: str) -> int:
    """Return the version of a preset, which grows whenever one of its values changes.

    Raises:
        UnknownName: no such preset; the message suggests the closest one.
    """
    return int(_read_preset(name)["version"])


def _read_preset(name: str) -> dict[str, Any]:
    if name not in preset_names():
        raise UnknownName("preset", name, preset_names())
    return tomllib.loads(files("pbcs_ompl.agents").joinpath(f"{name}.toml").read_text("utf-8"))


INPUTS = ("plain", "baselines")
"""See `inputs.py`."""
DEEPEST, WIDEST, LARGEST = 64, 16_384, 1_000_000_000
"""Of the layers of a network, and of a mini-batch or replay buffer: what is larger fits no machine."""


class WithNetworks(Protocol):
    """Settings of an agent with networks, a dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def hidden(self) -> tuple[int, ...]:
        """Widths of the hidden layers."""
        ...


def check_types_and_widths(settings: WithNetworks) -> None:
    """Check the types of settings against their defaults, and the widths of networks, which may be given as a list.

    Raises:
        InvalidOption: a value of the wrong type, or widths out of their range.
    """
    if isinstance(settings.hidden, list):
        object.__setattr__(settings, "hidden", tuple(settings.hidden))
    types = {field.name: type(field.default) for field in fields(settings)}
    check_types({name: getattr(settings, name) for name in types}, types)
    widths = [isinstance(width, int) and 0 < width <= WIDEST for width in settings.hidden]
    check_range("hidden", settings.hidden, 0 < len(widths) <= DEEPEST and all(widths),
                f"at most {DEEPEST} whole numbers from 1 to {WIDEST}")


@dataclass(frozen=True)
class AgentSettings:
    """Settings of any algorithm; the values are those of the preset "fast".

    Attributes:
        algorithm: The name of the algorithm's table in the files of presets.
        hidden: Widths of the hidden layers of actor and critic.
        layer_norm: Normalise the hidden layers.
        actor_learning_rate, critic_learning_rate: Of Adam.
        batch_size: Transitions in a mini-batch.
        discount: Of rewards, gamma.
        polyak: Fraction of a target network that stays in each update (1 - tau).
        replay_capacity: Transitions of each seed that are kept.
        initialisation: The law of new networks, a name in `initialisation.INITIALISATIONS`.
        inputs: How networks take observations and actions, "plain" or "baselines" (`inputs.py`).

    Raises:
        InvalidOption: a value of the wrong type or out of its range.
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
    initialisation: str = "torch"
    inputs: str = "plain"

    def __post_init__(self) -> None:
        check_types_and_widths(self)
        for name in ("actor_learning_rate", "critic_learning_rate"):
            check_range(name, getattr(self, name), 0.0 < getattr(self, name) < inf, "a positive number")
        for name in ("batch_size", "replay_capacity"):
            check_range(name, getattr(self, name), 1 <= getattr(self, name) <= LARGEST, f"from 1 to {LARGEST}")
        check_range("discount", self.discount, 0.0 <= self.discount < 1.0, "in [0, 1)")
        check_range("initialisation", self.initialisation, self.initialisation in INITIALISATIONS,
                    f"one of {', '.join(INITIALISATIONS)}")
        check_range("inputs", self.inputs, self.inputs in INPUTS, f"one of {', '.join(INPUTS)}")
        check_range("polyak", self.polyak, 0.0 <= self.polyak <= 1.0, "in [0, 1]")

    @classmethod
    def from_preset(cls, name: str, **changes: Any) -> Self:
        """Return the settings of a preset, some of them changed.

        Raises:
            UnknownName: no such preset.
            InvalidOption: the preset has no values for this algorithm, an unknown setting, or a value out of its range.
        """
        tables = _read_preset(name)
        if cls.algorithm not in tables and "common" not in tables:
            raise InvalidOption(f"preset {name!r} has no settings for {cls.algorithm!r}")
        values = tables.get("common", {}) | tables.get(cls.algorithm, {}) | changes
        check_names(f"agent {cls.algorithm!r}", "setting", values, [field.name for field in fields(cls)])
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Return all settings by name, as numbers and lists that TOML and JSON can hold; see `from_dict`."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the settings of `to_dict()`.

        Raises:
            InvalidOption: an unknown or a missing setting, or a value of the wrong type or out of its range.
        """
        check_names(f"agent {cls.algorithm!r}", "setting", values, [field.name for field in fields(cls)])
        missing = [field.name for field in fields(cls) if field.name not in values]
        if missing:
            raise InvalidOption(f"agent {cls.algorithm!r}: the setting {missing[0]!r} is missing; expected all of "
                                f"{', '.join(field.name for field in fields(cls))}")
        return cls(**values)
