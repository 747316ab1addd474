"""What is compared: planners x environments x seeds, and the budget of one run."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from pbcs_ompl.bridge.stopping import checked_limits
from pbcs_ompl.bridge.versions import planning_versions
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.compare.run import Job
from pbcs_ompl.resettable import make
from pbcs_ompl.results.folder import plain

Options = dict[str, Any]


class Environment(NamedTuple):
    """An environment by its Gymnasium id and its options."""

    env: str
    env_kwargs: Options

    @property
    def label(self) -> str:
        """Its name in tables, as pbcs/Maze-v0(size=7); without spaces, because OMPL's benchmark log allows none."""
        options = ",".join(f"{name}={_compact(value)}" for name, value in self.env_kwargs.items())
        return "".join((f"{self.env}({options})" if options else self.env).split())


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
    environments: list[Environment]
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
                    yield Job(name, planner, seed, *environment, options, self.max_transitions, self.max_seconds)

    def folder(self, number: int) -> str:
        """Return the name of the folder of the runs in the environment of this number; they are counted from 1."""
        return f"{number}-{self.environments[number - 1].env.rpartition('/')[2]}"

    def config(self) -> dict[str, Any]:
        """Return plain values, for config.toml."""
        return {"planners": list(self.planners), "environments": [place._asdict() for place in self.environments],
                "seeds": self.seeds, "max_transitions": self.max_transitions, "max_seconds": self.max_seconds,
                "max_memory": self.max_memory, "planner_kwargs": self.planners, "versions": self.versions}

    @classmethod
    def from_config(cls, config: dict[str, Any]) -> "Sweep":
        """Return the sweep whose `config` this was."""
        environments = [Environment(**place) for place in config["environments"]]
        planners = {name: config["planner_kwargs"].get(name, {}) for name in config["planners"]}
        return cls(planners, environments, config["seeds"], config["max_transitions"], config.get("max_seconds"),
                   config.get("max_memory"), config["versions"])


def make_sweep(planners: Sequence[str] | Mapping[str, Options], env: str | Sequence[str],
               env_kwargs: Options | Sequence[Options], seeds: int | Sequence[int], max_transitions: int,
               max_seconds: float | None, max_memory: float | None) -> Sweep:
    """Return the sweep that `compare` was asked for; see there.

    Raises:
        InvalidOption: something is missing, there twice, or out of its range.
        UnknownName, NoResetAnywhere, UnsupportedSpace: an environment cannot be made.
    """
    options = dict(planners) if isinstance(planners, Mapping) else {name: {} for name in planners}
    chosen = list(range(seeds)) if isinstance(seeds, int) else [int(seed) for seed in seeds]
    environments = _pair(env, env_kwargs)
    _check_unique("planners", list(planners))
    _check_unique("environments", [environment.label for environment in environments])
    _check_unique("seeds", chosen)
    limits = checked_limits(max_transitions, max_seconds)
    if max_memory is not None and not max_memory > 0:
        raise InvalidOption(f"max_memory is {max_memory}; expected more than 0 (MB)")
    for environment in environments:
        make(*environment)
    return Sweep(options, environments, chosen, *limits, max_memory, planning_versions())


def _pair(env: str | Sequence[str], env_kwargs: Options | Sequence[Options]) -> list[Environment]:
    """Return the environments: as many ids as options, or one of either for all of the other."""
    ids = [env] if isinstance(env, str) else list(env)
    options = [env_kwargs] if isinstance(env_kwargs, Mapping) else list(env_kwargs)
    if len(ids) == 1:
        ids *= len(options)
    if len(options) == 1:
        options *= len(ids)
    if len(ids) != len(options):
        raise InvalidOption(f"got {len(ids)} environments and {len(options)} sets of options; expected as many, or one "
                            "of either for all of the other")
    return [Environment(one, dict(chosen)) for one, chosen in zip(ids, options, strict=True)]


def _check_unique(kind: str, values: Sequence[Any]) -> None:
    if not values:
        raise InvalidOption(f"got no {kind}; expected one at least")
    if len(set(values)) < len(values):
        raise InvalidOption(f"{kind} holds something twice: {values}")


def _compact(value: Any) -> str:
    return json.dumps(value, default=plain, separators=(",", ":")).strip('"')
