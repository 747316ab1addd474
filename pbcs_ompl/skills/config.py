"""Training methods by name, and the configuration that a training is a function of."""

import json
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pbcs_ompl.agents.settings import AgentSettings, preset_version
from pbcs_ompl.agents.update import choose_device
from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, UnknownName
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.options import check_names, check_range, check_types
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.trust import config_modules, refuse_modules
from pbcs_ompl.results import schema
from pbcs_ompl.results.files import read_toml
from pbcs_ompl.results.schema import check
from pbcs_ompl.skills.agent_interface import Agent, AgentFactory, AgentSettingsValues, far_sighted, load_agent
from pbcs_ompl.skills.method import TrainingMethod
from pbcs_ompl.skills.path_following.follow import Follow
from pbcs_ompl.skills.path_following.settings import FollowSettings
from pbcs_ompl.skills.path_following.shown_feature import how_to_show, observes_feature
from pbcs_ompl.skills.pbcs import PBCS, PBCSSettings
from pbcs_ompl.skills.settings import MethodSettings, PlannedSettings, flat_names, read_preset
from pbcs_ompl.skills.single_policy import (
    PB,
    BackplaySettings,
    Bootstrapped,
    Offline,
    OfflineSettings,
    PBSettings,
    Plain,
    PlainSettings,
    SlidingWindow,
)
from pbcs_ompl.skills.trainer import SkillTrainer


class MethodEntry(NamedTuple):
    """A training method, the type of its settings, and the planner whose plans it trains along unless one is named."""

    build: Callable[[SkillTrainer, Any], TrainingMethod]
    settings: type[MethodSettings]
    planner: str = "Ex"

    @property
    def needs_plan(self) -> bool:
        """Whether it trains along a plan."""
        return issubclass(self.settings, PlannedSettings)


METHODS: dict[str, MethodEntry] = {
    "pbcs": MethodEntry(PBCS, PBCSSettings),
    "pb": MethodEntry(PB, PBSettings),
    "backplay": MethodEntry(SlidingWindow, BackplaySettings),
    "follow": MethodEntry(Follow, FollowSettings, "Rides"),
    "plain": MethodEntry(Plain, PlainSettings),
    "bootstrapped": MethodEntry(Bootstrapped, OfflineSettings),
    "offline": MethodEntry(Offline, OfflineSettings),
}


def find_method(name: str) -> MethodEntry:
    """Return a training method.

    Raises:
        UnknownName: there is none of this name; the message suggests the closest one.
    """
    if name not in METHODS:
        raise UnknownName("method", name, METHODS)
    return METHODS[name]


def usual_method(preset: str, model: ResettableModel) -> str:
    """Return the method of a preset; PBCS where it is path following and the model's feature is not observed.

    Raises:
        UnknownName: no such preset.
        CallbackFailed: the environment raised.
    """
    method = str(read_preset(preset)["method"])
    if method == "follow" and not observes_feature(model):
        warnings.warn(f"{model.spec.id}: what is explored is no part of the observation, so no policy can follow a "
                      f"path; the method is pbcs (to follow paths, {how_to_show(model)})", stacklevel=3)
        return "pbcs"
    return method


def method_settings(method: str, preset: str = "fast", changes: Mapping[str, Any] | None = None) -> MethodSettings:
    """Return the settings that a preset has for a method, some of them changed.

    Args:
        method: A name in `METHODS`.
        preset: A file of this folder.
        changes: New values by name ("epsilon"), by path ("episodes.epsilon"), or as tables of groups.

    Raises:
        UnknownName: no such method or preset.
        InvalidOption: the method has no such setting, or a value of the wrong type or out of its range.
    """
    entry, tables = find_method(method), read_preset(preset)
    check_names(f"preset {preset!r}", "table", tables.keys() - {"version", "method"}, {"common", *METHODS})
    _check_settings(method, flat_names(changes or {}))
    defaults = entry.settings().updated(tables.get("common", {}) | tables.get(method, {}))
    return defaults.updated(changes or {})


def _check_settings(method: str, names: Mapping[str, Any]) -> None:
    """Refuse settings that the method does not have; name the methods that have them."""
    for name in names:
        owners = [other for other, entry in METHODS.items() if name in entry.settings.paths()]
        if owners and method not in owners:
            raise InvalidOption(f"method {method!r} has no setting {name!r}; it is a setting of {', '.join(owners)}")
        known = [path for path in METHODS[method].settings.paths() if ("." in path) == ("." in name)]
        check_names(f"method {method!r}", "setting", [name], known)


@dataclass(frozen=True)
class TrainConfig:
    """Everything but the environment that a training is a function of, with all values resolved.

    Attributes:
        method: A name in `METHODS`.
        planner: Plans; None where nothing is planned: the trajectory is given, or the method has none.
        planner_kwargs: Its options.
        agent: A registered agent, or module:Class.
        preset: The preset that unchanged settings come from: provenance, which nothing reads again.
        preset_versions: Its versions, for "skills" and, if it is one of ours, for the "agent".
        settings: All settings of the method.
        agent_settings: All settings of the agent.
        seed: Root of all random streams.
        max_transitions: Budget of environment steps, planning included.
        device: Where the agent trains, "cpu" or "cuda".

    Raises:
        UnknownName, InvalidOption: an unknown method, planner, agent or option, or a value out of its range.
    """

    method: str
    planner: str | None
    planner_kwargs: dict[str, Any]
    agent: str
    preset: str
    preset_versions: dict[str, int]
    settings: MethodSettings
    agent_settings: AgentSettingsValues
    seed: int
    max_transitions: int
    device: str

    def __post_init__(self) -> None:
        check_types({"seed": self.seed, "max_transitions": self.max_transitions}, {"seed": int, "max_transitions": int})
        check_range("seed", self.seed, self.seed >= 0, "at least 0")
        check_range("max_transitions", self.max_transitions, self.max_transitions >= 1, "at least 1")
        if self.planner is not None:
            PlannerSpec(self.planner, self.planner_kwargs)
        load_agent(self.agent)
        choose_device(self.device)

    @classmethod
    def resolve(cls, *, method: str, planner: str | None, planner_kwargs: Mapping[str, Any] | None, agent: str,
                preset: str, settings: Mapping[str, Any] | None, agent_settings: Mapping[str, Any] | None, seed: int,
                max_transitions: int, device: str, planned: bool) -> "TrainConfig":
        """Return the configuration that these choices of `train` stand for.

        Args:
            planned: Whether a trajectory is given.

        Raises:
            UnknownName, InvalidOption: see the class; also a planner or a trajectory that is not used.
        """
        entry = find_method(method)
        needs_plan = entry.needs_plan
        if not needs_plan and (planned or planner is not None or planner_kwargs):
            raise InvalidOption(f"method {method!r} trains without a plan; remove trajectory, planner and "
                                "planner_kwargs, or choose from "
                                f"{', '.join(name for name, entry in METHODS.items() if entry.needs_plan)}")
        if planned and (planner is not None or planner_kwargs):
            raise InvalidOption("a trajectory is given, so nothing is planned; remove planner and planner_kwargs")
        chosen = load_agent(agent).settings_type.from_preset(preset, **(agent_settings or {}))
        versions = {"skills": int(read_preset(preset)["version"])}
        if isinstance(chosen, AgentSettings):
            versions["agent"] = preset_version(preset)
        used = (planner or entry.planner) if needs_plan and not planned else None
        return cls(method, used, dict(planner_kwargs or {}), agent, preset, versions,
                   method_settings(method, preset, settings), chosen, seed, max_transitions, device)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, as config.toml holds them."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return values | {"planner_kwargs": json.loads(json.dumps(self.planner_kwargs, default=plain)),
                         "settings": self.settings.to_dict(), "agent_settings": self.agent_settings.to_dict()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "TrainConfig":
        """Return the configuration of `to_dict`; no preset is read.

        Raises:
            DamagedFile: a value is missing or wrong.
            UnknownName, InvalidOption: the method, planner, agent or device is not here.
        """
        method, agent = find_method(str(values.get("method"))), load_agent(str(values.get("agent")))
        known: dict[str, Any] = {name: values.get(name) for name in cls.__dataclass_fields__}
        try:
            known["settings"] = method.settings.from_dict(values["settings"])
            known["agent_settings"] = agent.settings_type.from_dict(values["agent_settings"])
            return cls(**known)
        except (KeyError, TypeError, AttributeError, InvalidOption) as error:
            raise DamagedFile(f"not the configuration of a training: {error}") from error

    def agent_factory(self, model: ResettableModel) -> AgentFactory:
        """Return a function that builds an agent for `model` from a seed."""
        kind, spaces = load_agent(self.agent), self.settings.agent_spaces(model)

        def build(seed: int, horizon: float = 1.0) -> Agent:
            settings = far_sighted(self.agent_settings, kind.settings_type, horizon)
            return kind(*spaces, settings=settings, seeds=(seed,), device=self.device)

        return build


def read_config(path: Path, *, trust: bool = False) -> tuple[EnvSpec, TrainConfig, dict[str, str]]:
    """Return what a config.toml holds: the environment, the configuration, and the versions of packages.

    Args:
        path: The file.
        trust: Import the modules that it names.

    Raises:
        DamagedFile: the file is not that of a training.
        UntrustedModule: it names a module, and is not trusted.
        UnknownName, InvalidOption: see `TrainConfig.from_dict`.
    """
    values = read_toml(path)
    if values.get("kind") != "train":
        raise DamagedFile(f"{path} is not that of a training: its kind is {values.get('kind')!r}; expected 'train'")
    try:
        environment = EnvSpec.from_dict(values.get("environment"), trusted=trust)
        if not trust:
            refuse_modules(str(path), [*environment.modules, *config_modules(values)])
        check(path, values, schema.TrainConfig)
        return environment, TrainConfig.from_dict(values), values.get("versions", {})
    except DamagedFile as error:
        raise DamagedFile(f"{path}: {error}") from error
