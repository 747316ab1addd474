"""Settings of training methods: the groups that methods share, and presets, one TOML file for each.

Each method adds its own settings in a subclass of `MethodSettings` beside its code. Defaults are those of
[Matheron2020]. A preset's table [common] holds for all methods, those that are called like a method for that one.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple, Self

from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.options import check_names, check_range, check_types
from pbcs_ompl.core.types import Array


@dataclass(frozen=True)
class Settings:
    """A frozen dataclass of plain values, and of groups: other `Settings`, one level deep.

    Raises:
        InvalidOption: a value of another type than its default, or out of its range.
    """

    def __post_init__(self) -> None:
        types = {name: type(default) for name, default in self.defaults().items()}
        check_types({name: getattr(self, name) for name in types}, types)
        self._check_ranges()

    def _check_ranges(self) -> None:
        """Refuse values out of their range."""

    def _check(self, expected: str, holds: Callable[[Any], bool], *names: str) -> None:
        for name in names:
            check_range(name, getattr(self, name), holds(getattr(self, name)), expected)

    def _check_counts(self, *names: str) -> None:
        self._check_at_least(1, *names)

    def _check_at_least(self, least: float, *names: str) -> None:
        self._check(f"at least {least:g}", lambda value: value >= least, *names)

    def _check_fractions(self, *names: str) -> None:
        self._check("within [0, 1]", lambda value: 0 <= value <= 1, *names)

    def _check_positive(self, *names: str) -> None:
        self._check("greater than 0", lambda value: value > 0, *names)

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """Return the default of each value and group."""
        return {part.name: part.default if part.default_factory is MISSING else part.default_factory()
                for part in fields(cls)}

    @classmethod
    def paths(cls) -> dict[str, str]:
        """Return the path of each setting under its name and under its path: "epsilon" is "episodes.epsilon"."""
        found: dict[str, str] = {}
        for name, default in cls.defaults().items():
            if isinstance(default, Settings):
                inner = {leaf: f"{name}.{leaf}" for leaf in default.paths()}
                found |= inner | {path: path for path in inner.values()}
            else:
                found[name] = name
        return found

    def updated(self, changes: Mapping[str, Any]) -> Self:
        """Return a copy with some settings replaced.

        Args:
            changes: New values by name ("epsilon"), by path ("episodes.epsilon"), or as tables of groups.

        Raises:
            InvalidOption: an unknown name, or a value of the wrong type or out of its range.
        """
        flat, paths = flat_names(changes), self.paths()
        check_names(type(self).__name__, "setting", flat, paths)
        own: dict[str, Any] = {}
        groups: dict[str, dict[str, Any]] = {}
        for name, value in flat.items():
            group, _, leaf = paths[name].rpartition(".")
            (groups.setdefault(group, {}) if group else own)[leaf] = value
        return replace(self, **own, **{group: replace(getattr(self, group), **values)
                                       for group, values in groups.items()})

    def to_dict(self) -> dict[str, Any]:
        """Return all settings by name, groups as tables; see `from_dict`."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the settings of `to_dict()`.

        Raises:
            InvalidOption: an unknown or a missing setting, or a value of the wrong type or out of its range.
        """
        defaults = cls.defaults()
        check_names(cls.__name__, "setting", values, defaults)
        missing = [name for name in defaults if name not in values]
        if missing:
            raise InvalidOption(f"{cls.__name__} lacks the setting {missing[0]!r}; expected {', '.join(defaults)}")
        tables = {name: default for name, default in defaults.items() if isinstance(default, Settings)}
        check_types({name: values[name] for name in tables}, dict.fromkeys(tables, dict))
        return cls(**dict(values) | {name: type(group).from_dict(values[name]) for name, group in tables.items()})


def flat_names(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changes without tables: {"episodes": {"epsilon": 0.2}} is {"episodes.epsilon": 0.2}."""
    flat: dict[str, Any] = {}
    for name, value in changes.items():
        flat |= {f"{name}.{leaf}": inner for leaf, inner in value.items()} if isinstance(value, Mapping) else {
            name: value}
    return flat


@dataclass(frozen=True)
class EpisodeSettings(Settings):
    """How experience is collected, rewarded, learnt from and tested.

    Attributes:
        beta: Episodes of a session and of a test ([Matheron2020] Alg. 7 and 8; 50 in chapter 7).
        epsilon: Fraction of random actions while collecting experience ([Matheron2020] chapter 7).
        test_epsilon: Fraction of random actions in tests ([Matheron2020]: 0).
        first_trials: Episodes of a test that run before the others, which are left out where some of these fail, but
            not all: only rates of 0 and 1 have a consequence ([Matheron2020]: 0, all run).
        max_steps: Longest episode of a skill, in steps ([Matheron2020] chapter 7); 0 for the environment's limit.
        steps_per_waypoint: Where this number times the waypoints from a start to the target is more than `max_steps`,
            it is the limit instead, up to the environment's (ours; 0 for none).
        updates_per_transition: Gradient steps for each collected transition ([Matheron2020] Alg. 8).
        episodes_per_batch: Episodes that run side by side between updates ([Matheron2020] Alg. 8: 1).
        shaped: Train on the shaped reward ([Matheron2020] 7.2.3) instead of the environment's own.
        success_reward: The shaped reward for reaching the goal ([Matheron2020] 7.2.3).
    """

    beta: int = 50
    epsilon: float = 0.1
    test_epsilon: float = 0.0
    first_trials: int = 0
    max_steps: int = 50
    steps_per_waypoint: float = 0.0
    updates_per_transition: float = 1.0
    episodes_per_batch: int = 1
    shaped: bool = True
    success_reward: float = 10.0

    def _check_ranges(self) -> None:
        self._check_counts("beta", "episodes_per_batch")
        self._check_at_least(0, "max_steps", "steps_per_waypoint", "first_trials")
        self._check_fractions("epsilon", "test_epsilon")
        self._check_positive("updates_per_transition")


@dataclass(frozen=True)
class StartSettings(Settings):
    """Where episodes start: in a ball around a state, or in that state.

    Attributes:
        exact: Episodes start exactly in the state ([Matheron2020] chapter 5), else in the ball around it (7.2.4).
        radius: Radius of start balls, activation sets and local goals, in the environment's distance (epsilon of
            [Matheron2020] 7.2).
        reject_invalid: Draw again when a start state is invalid; [Matheron2020] keeps it.
        rollout_steps: Longest random rollout that draws a start state, in simulators where a vector near a state need
            not be a state (ours, not tuned).
    """

    exact: bool = False
    radius: float = 0.1
    reject_invalid: bool = True
    rollout_steps: int = 5

    def _check_ranges(self) -> None:
        self._check_positive("radius")
        self._check_counts("rollout_steps")


@dataclass(frozen=True)
class PlanSettings(Settings):
    """How a plan becomes waypoints, and how policies observe the world along it.

    Attributes:
        remove_loops: Erase loops of the plan first (ours).
        relative_observations: Policies observe (o - o_goal) / scale, see `ObservationTransform` (ours).
        observation_horizon: The scale of relative observations is the largest movement in one step of the plan times
            this number of steps (ours, not tuned: observations near the goal are of order one).
        preceding_waypoints: Waypoints before a start point from which random rollouts may begin (ours: as many as
            `rollout_steps`; with 0, training stalls at 52 % of a plan of Ex on MountainCarContinuous-v0, seed 0).
        improve: Transitions that may make a plan shorter after the search, for each transition of the search (ours).
        search_on: Where these save less than a tenth of the steps of a plan of Rides, the search is repeated, and
            continued by RidesSST with this many transitions for each one of it (ours; 0 for never).
    """

    improve: float = 0.0
    search_on: float = 0.0
    remove_loops: bool = False
    relative_observations: bool = False
    observation_horizon: int = 10
    preceding_waypoints: int = 5

    def _check_ranges(self) -> None:
        self._check_counts("observation_horizon")
        self._check_at_least(0, "improve", "search_on", "preceding_waypoints")


@dataclass(frozen=True)
class CriterionSettings(Settings):
    """When a training counts as solved, and how long an execution may take.

    Attributes:
        robust_epsilon: Fraction of random actions in the noisy executions (ours: that of [Matheron2020] in training).
        robust_rate: Success rate that they must reach (ours, by definition).
        robust_episodes: Their number (ours: the Wilson interval of 95 of 100 is 89 % to 98 %).
        time_limit_factor: An execution fails after this factor times `max_steps` times the number of skills (ours, not
            tuned).
    """

    robust_epsilon: float = 0.1
    robust_rate: float = 0.95
    robust_episodes: int = 100
    time_limit_factor: int = 2

    def _check_ranges(self) -> None:
        self._check_fractions("robust_epsilon", "robust_rate")
        self._check_counts("robust_episodes", "time_limit_factor")


class AgentSpaces(NamedTuple):
    """Length O of what an agent sees, and the box [A] of what it does."""

    observation_size: int
    action_low: Array
    action_high: Array


@dataclass(frozen=True)
class MethodSettings(Settings):
    """What can be set in every training method."""

    episodes: EpisodeSettings = field(default_factory=EpisodeSettings)
    starts: StartSettings = field(default_factory=StartSettings)
    criterion: CriterionSettings = field(default_factory=CriterionSettings)

    def agent_spaces(self, model: ResettableModel) -> AgentSpaces:
        """Return what agents of this method see and do: observations and controls of the model."""
        return AgentSpaces(model.observation_size, model.action_low, model.action_high)

    @property
    def steps_per_skill(self) -> int:
        """Time limit of an execution, in steps for each skill."""
        return self.criterion.time_limit_factor * self.episodes.max_steps


@dataclass(frozen=True)
class PlannedSettings(MethodSettings):
    """What can be set in every method that trains along a plan."""

    plan: PlanSettings = field(default_factory=PlanSettings)


def preset_names() -> list[str]:
    """Return the names of all presets, sorted."""
    return sorted(entry.name.removesuffix(".toml") for entry in files("pbcs_ompl.skills").iterdir()
                  if entry.name.endswith(".toml"))


@cache
def read_preset(name: str) -> dict[str, Any]:
    """Return the tables of a preset, its usual "method", and a "version" that grows whenever one of its values changes.

    Raises:
        UnknownName: no such preset; the message suggests the closest one.
    """
    if name not in preset_names():
        raise UnknownName("preset", name, preset_names())
    return tomllib.loads(files("pbcs_ompl.skills").joinpath(f"{name}.toml").read_text("utf-8"))
