"""What is compared: planners x environments x seeds, and the budget of one run."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pbcs_ompl.bridge.termination import checked_limits
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.compare.run import Job
from pbcs_ompl.resettable import make
from pbcs_ompl.results.provenance import planning_versions

Options = dict[str, Any]


@dataclass(frozen=True)
class Sweep:
    """Planners x environments x seeds, checked.

    Attributes:
        planners: The options of each planner, by its name.
        environments: Each with a label of its own.
        seeds: The seeds.
        max_transitions, max_seconds, max_memory: The budget of one run; None for any.
        versions: The packages that the runs depend on.
    """

    planners: dict[str, Options]
    environments: list[EnvSpec]
    seeds: list[int]
    max_transitions: int
    max_seconds: float | None
    max_memory: float | None
    versions: dict[str, str]

    def jobs(self) -> Iterator[Job]:
        """Yield the runs, seed by seed, so that all planners are equally far when a comparison is stopped."""
        for seed in self.seeds:
            for number, environment in enumerate(self.environments, start=1):
                for planner, options in self.planners.items():
                    name = f"{self.folder(number)}/{planner.replace(':', '.')}-{seed}"
                    yield Job(name, planner, seed, environment, options, self.max_transitions, self.max_seconds)

    def folder(self, number: int) -> str:
        """Return the name of the folder of the runs in the environment of this number; they are counted from 1."""
        return f"{number}-{self.environments[number - 1].id.rpartition('/')[2]}"

    def config(self) -> dict[str, Any]:
        """Return plain values, for config.toml."""
        return {"kind": "compare", "planners": list(self.planners),
                "environments": [environment.to_dict() for environment in self.environments],
                "seeds": self.seeds, "max_transitions": self.max_transitions, "max_seconds": self.max_seconds,
                "max_memory": self.max_memory, "planner_kwargs": self.planners, "versions": self.versions}

    @classmethod
    def from_config(cls, config: dict[str, Any]) -> "Sweep":
        """Return the sweep whose `config` this was."""
        environments = [EnvSpec.from_dict(place) for place in config["environments"]]
        planners = {name: config["planner_kwargs"].get(name, {}) for name in config["planners"]}
        return cls(planners, environments, config["seeds"], config["max_transitions"], config.get("max_seconds"),
                   config.get("max_memory"), config["versions"])


def make_sweep(planners: Sequence[str] | Mapping[str, Options], environments: Sequence[EnvSpec],
               seeds: int | Sequence[int], max_transitions: int, max_seconds: float | None,
               max_memory: float | None) -> Sweep:
    """Return the sweep that `compare` was asked for; see there.

    Raises:
        InvalidOption: something is missing, there twice, or out of its range.
        UnknownName, NotResettable, UnsupportedSpace: an environment cannot be made.
    """
    options = dict(planners) if isinstance(planners, Mapping) else {name: {} for name in planners}
    chosen = list(range(seeds)) if isinstance(seeds, int) else [int(seed) for seed in seeds]
    _check_unique("planners", list(planners))
    _check_unique("environments", [environment.label for environment in environments])
    _check_unique("seeds", chosen)
    limits = checked_limits(max_transitions, max_seconds)
    if max_memory is not None and not max_memory > 0:
        raise InvalidOption(f"max_memory is {max_memory}; expected more than 0 (MB)")
    for environment in environments:
        make(environment)
    return Sweep(options, list(environments), chosen, *limits, max_memory, planning_versions())


def pair_environments(env: str | EnvSpec | Sequence[str | EnvSpec], env_kwargs: Options | Sequence[Options] | None, *,
                      goal: str | None = None, feature: str | None = None,
                      start_seed: int | None = None) -> list[EnvSpec]:
    """Return the environments of a comparison.

    Args:
        env, env_kwargs: As many ids as options, or one of either for all of the other; specs have theirs already.
        goal, feature, start_seed: The rules of all of them.

    Raises:
        InvalidOption: the numbers do not match, or options are given for specs.
    """
    given = [env] if isinstance(env, str | EnvSpec) else list(env)
    options = [{}] if env_kwargs is None else [env_kwargs] if isinstance(env_kwargs, Mapping) else list(env_kwargs)
    if len(given) == 1:
        given *= len(options)
    if len(options) == 1:
        options *= len(given)
    if len(given) != len(options):
        raise InvalidOption(f"got {len(given)} environments and {len(options)} sets of options; expected as many, or "
                            "one of either for all of the other")
    return [_spec(one, dict(chosen), goal, feature, start_seed) for one, chosen in zip(given, options, strict=True)]


def _spec(env: str | EnvSpec, options: Options, goal: str | None, feature: str | None,
          start_seed: int | None) -> EnvSpec:
    if isinstance(env, str):
        return EnvSpec(env, options, goal, feature, start_seed)
    if options:
        raise InvalidOption(f"{env} has its options already; leave out env_kwargs")
    return replace(env, goal=env.goal if goal is None else goal, feature=env.feature if feature is None else feature,
                   start_seed=env.start_seed if start_seed is None else start_seed)


def _check_unique(kind: str, values: Sequence[Any]) -> None:
    if not values:
        raise InvalidOption(f"got no {kind}; expected one at least")
    if len(set(values)) < len(values):
        raise InvalidOption(f"{kind} holds something twice: {values}")
