"""Named, versioned settings of the agents, as data.

One TOML file for each preset, with one table for each algorithm.
"""

import tomllib
from dataclasses import fields
from importlib.resources import files
from typing import Any, TypeVar

from pbcs_ompl.core.errors import InvalidOption, UnknownName, did_you_mean

Settings = TypeVar("Settings")


def preset_names() -> list[str]:
    """Return the names of all presets, sorted."""
    entries = [entry.name for entry in files("pbcs_ompl.agents").iterdir()]
    return sorted(name.removesuffix(".toml") for name in entries if name.endswith(".toml"))


def preset(name: str, algorithm: str) -> dict[str, Any]:
    """Return the values that preset `name` has for one algorithm.

    Raises:
        UnknownName: no such preset; the message suggests the closest one.
        InvalidOption: the preset says nothing of this algorithm.
    """
    if name not in preset_names():
        raise UnknownName("preset", name, preset_names())
    tables = tomllib.loads(files("pbcs_ompl.agents").joinpath(f"{name}.toml").read_text())
    if algorithm not in tables:
        raise InvalidOption(f"preset {name!r} has no settings for {algorithm!r}")
    return dict(tables[algorithm])


def make_settings(kind: type[Settings], values: dict[str, Any]) -> Settings:
    """Build a dataclass of settings from names and values.

    Raises:
        InvalidOption: a name that the dataclass does not have; the message suggests the closest one.
    """
    known = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    for name in values:
        if name not in known:
            raise InvalidOption(f"unknown setting {name!r} of the agent{did_you_mean(name, known)}")
    return kind(**values)
