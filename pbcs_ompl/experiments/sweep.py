"""What is compared: planners x environments x seeds, and the budget of one run."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.bridge.improvement.allowance import Allowance
from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.bridge.problem import make_problem
from pbcs_ompl.bridge.termination import checked_limits
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, PlannerUnavailable
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import quiet_ompl
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.types import Counter
from pbcs_ompl.experiments.run import Run, check_number_of_seeds
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.known_goal import check_goal
from pbcs_ompl.resettable.make import is_known
from pbcs_ompl.results.provenance import planning_versions

Options = dict[str, Any]
Environment = str | EnvSpec | gymnasium.Env | ResettableModel
"""An environment that other processes can make: an id, a spec, or what has the spec of a registered id."""


@dataclass(frozen=True)
class Sweep:
    """Planners x environments x seeds, checked.

    Attributes:
        planners: The options of each planner, defaults included, by its name.
        environments: Each with a label of its own.
        seeds: The seeds.
        max_transitions, max_seconds, max_memory: The budget of one run; None for any.
        improve: What making each plan shorter may use (see `plan`); None for nothing.
        versions: The packages that the runs depend on.
    """

    planners: dict[str, Options]
    environments: list[EnvSpec]
    seeds: list[int]
    max_transitions: int
    max_seconds: float | None
    max_memory: float | None
    improve: int | str | None
    versions: dict[str, str]

    def runs(self) -> Iterator[Run]:
        """Yield the runs, seed by seed, so that all planners are equally far when a comparison is stopped."""
        for seed in self.seeds:
            for number, environment in enumerate(self.environments, start=1):
                for planner, options in self.planners.items():
                    name = f"{self.folder(number)}/{planner.replace(':', '.')}-{seed}"
                    yield Run(name, {"planner": planner, "planner_kwargs": options, "seed": seed,
                                     "environment": environment.to_dict(), "max_transitions": self.max_transitions,
                                     "max_seconds": self.max_seconds, "improve": self.improve})

    def folder(self, number: int) -> str:
        """Return the name of the folder of the runs in the environment of this number; they are counted from 1."""
        return f"{number}-{self.environments[number - 1].id.rpartition('/')[2].replace(':', '.')}"

    def config(self) -> dict[str, Any]:
        """Return plain values, for config.toml."""
        return {"kind": "compare", "planners": list(self.planners),
                "environments": [environment.to_dict() for environment in self.environments],
                "seeds": self.seeds, "max_transitions": self.max_transitions, "max_seconds": self.max_seconds,
                "max_memory": self.max_memory, "improve": self.improve, "planner_kwargs": self.planners,
                "versions": self.versions}

    @classmethod
    def from_config(cls, config: dict[str, Any]) -> "Sweep":
        """Return the sweep whose `config` this was."""
        environments = [EnvSpec.from_dict(place) for place in config["environments"]]
        planners = {name: config["planner_kwargs"].get(name, {}) for name in config["planners"]}
        return cls(planners, environments, config["seeds"], config["max_transitions"], config.get("max_seconds"),
                   config.get("max_memory"), config.get("improve"), config["versions"])


def make_sweep(planners: Sequence[str] | Mapping[str, Options], environments: Sequence[EnvSpec],
               seeds: int | Sequence[int], max_transitions: int, max_seconds: float | None,
               max_memory: float | None, improve: int | str | None = None) -> Sweep:
    """Return the sweep of a comparison. The arguments are those of `compare`; see there.

    Args:
        planners: Names, or options by name.
        environments: The environments.
        seeds: How many seeds (0, 1, ...), or the seeds.
        max_transitions, max_seconds, max_memory: The budget of one run.
        improve: What making each plan shorter may use.

    Raises:
        InvalidOption: something is missing, there twice, or out of its range; a planner refuses an option.
        UnknownName, NotResettable, UnsupportedSpace: a planner or an environment cannot be made.
    """
    options = dict(planners) if isinstance(planners, Mapping) else {name: {} for name in planners}
    if not isinstance(seeds, Sequence | np.ndarray):
        seeds = range(check_number_of_seeds(int(seeds)))
    chosen = [int(seed) for seed in seeds]
    _check_unique("planners", list(planners))
    _check_unique("environments", [environment.label for environment in environments])
    _check_unique("seeds", chosen)
    limits = checked_limits(max_transitions, max_seconds)
    if improve is not None:
        Allowance.of(improve)
    models = [make(environment) for environment in environments]
    for model in models:
        check_goal(model)
    resolved = {name: _resolved(name, given, models[0]) for name, given in options.items()}
    return Sweep(resolved, list(environments), chosen, *limits, max_memory, improve,
                 planning_versions())


def environment_specs(env: Environment | Sequence[Environment], env_kwargs: Options | Sequence[Options] | None = None,
                      *, goal: str | None = None, feature: str | None = None,
                      start_seed: int | None = None, reset_options: Options | None = None) -> list[EnvSpec]:
    """Return the specs of the environments of a comparison.

    Args:
        env: One environment or several.
        env_kwargs: Options of ids: as many as there are environments, or one of either for all of the other.
        goal, feature, start_seed, reset_options: The rules of all of them.

    Raises:
        InvalidOption: the numbers do not match, options are given for what has its own, or an environment is not
            registered.
    """
    given = list(env) if isinstance(env, Sequence) and not isinstance(env, str) else [env]
    options = [{}] if env_kwargs is None else [env_kwargs] if isinstance(env_kwargs, Mapping) else list(env_kwargs)
    if len(given) == 1:
        given *= len(options)
    if len(options) == 1:
        options *= len(given)
    if len(given) != len(options):
        raise InvalidOption(f"got {len(given)} environments and {len(options)} sets of options; expected as many, or "
                            "one of either for all of the other")
    rules = {"goal": goal, "feature": feature, "start_seed": start_seed, "reset_options": reset_options}
    chosen = {name: rule for name, rule in rules.items() if rule is not None}
    return [_spec(one, dict(kwargs), chosen) for one, kwargs in zip(given, options, strict=True)]


def _spec(env: Environment, options: Options, rules: dict[str, Any]) -> EnvSpec:
    if isinstance(env, str):
        return EnvSpec(env, dict(options), **rules)
    spec = env if isinstance(env, EnvSpec) else make(env).spec
    if options:
        raise InvalidOption(f"{spec} has its options already; leave out env_kwargs")
    if not isinstance(env, EnvSpec) and not is_known(spec.id):
        raise InvalidOption(f"{spec} is not registered, so that other processes cannot make it; register it with "
                            "gymnasium.register, and give its id (module:id where a module registers it)")
    return replace(spec, **rules)


def _resolved(planner: str, options: Options, model: ResettableModel) -> Options:
    """Return all options of a planner, defaults included, but for those that it takes from the environment.

    A planner that cannot be built here keeps the given ones, and its runs fail.

    Raises:
        UnknownName, InvalidOption: there is no such planner or option, or the planner refuses a value.
    """
    try:
        spec = PlannerSpec(planner, options)
        with make_problem(model, counter=Counter(1)) as problem, quiet_ompl():
            settings = spec.settings(spec.build(problem.space_information, 0))
    except (PlannerUnavailable, MissingDependency):
        return options
    return {name: value for name, value in settings.items() if name in options or _is_plain(value)}


def _is_plain(value: Any) -> bool:
    try:
        json.dumps(value, default=plain)
    except TypeError:
        return False
    return True


def _check_unique(kind: str, values: Sequence[Any]) -> None:
    if not values:
        raise InvalidOption(f"got no {kind}; expected one at least")
    if len(set(values)) < len(values):
        raise InvalidOption(f"{kind} holds something twice: {values}")
