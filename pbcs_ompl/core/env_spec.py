"""The task as one object: which environment, what a success is, what planners explore, where episodes start."""

import json
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, NotRequired, TypedDict

import msgspec

from pbcs_ompl.core.checked import check_fields
from pbcs_ompl.core.errors import DamagedFile, InvalidOption
from pbcs_ompl.core.plain import from_nulls, plain, to_nulls
from pbcs_ompl.core.trust import is_module_name, module_names, refuse_modules


class EnvValues(TypedDict):
    """An `EnvSpec` as files hold it."""

    id: Annotated[str, msgspec.Meta(min_length=1)]
    kwargs: NotRequired[dict[str, Any]]
    goal: NotRequired[str]
    feature: NotRequired[str]
    start_seed: NotRequired[Annotated[int, msgspec.Meta(ge=0)]]
    reset_options: NotRequired[dict[str, Any]]
    max_episode_steps: NotRequired[Annotated[int, msgspec.Meta(ge=1)]]


@dataclass(frozen=True)
class EnvSpec:
    """What makes the same resettable model again, in this or another process.

    Attributes:
        id: The id that `gymnasium.make` takes, such as "pbcs/Maze-v0" or "module:id".
        kwargs: Options of the environment.
        goal: What a success is, as a rule; None for what the environment reports (see `resettable.rules`).
        feature: What planners explore, as a rule; None for the adapter's choice.
        start_seed: Every episode starts as `reset(seed=start_seed)` does; None where each has a seed of its own.
        reset_options: What every reset gets as `options`; None for nothing.
        max_episode_steps: Steps after which an episode is cut off; None for the limit that the id is registered with.
        trusted: Whether modules that it names may be imported: they were typed by the user, not read from a file.

    Raises:
        InvalidOption: a value has another type, `start_seed` is not >= 0, or `max_episode_steps` not >= 1.

    Example:
        >>> import pbcs_ompl
        >>> pbcs_ompl.EnvSpec("pbcs/Maze-v0", {"size": 5, "maze_seed": 1}).id
        'pbcs/Maze-v0'
    """

    id: str
    kwargs: dict[str, Any] = field(default_factory=dict)
    goal: str | None = None
    feature: str | None = None
    start_seed: int | None = None
    reset_options: dict[str, Any] | None = None
    max_episode_steps: int | None = None
    trusted: bool = field(default=True, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_fields(self)
        _check_integer("start_seed", self.start_seed, 0)
        _check_integer("max_episode_steps", self.max_episode_steps, 1)

    def reset_seed(self, seed: int | None) -> int | None:
        """Return the seed of the reset in an episode that was given `seed`."""
        return seed if self.start_seed is None else self.start_seed

    @property
    def label(self) -> str:
        """Its name in tables, as pbcs/Maze-v0(size=7); different options have different names."""
        rules = {name: value for name, value in self.to_dict().items() if name not in ("id", "kwargs")}
        options = ",".join(f"{name}={_compact(value)}" for name, value in {**self.kwargs, **rules}.items())
        return f"{self.id}({options})" if options else self.id

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, as files hold them; rules that are None are left out, None in options is `NULL`."""
        rules = {"goal": self.goal, "feature": self.feature, "start_seed": self.start_seed,
                 "reset_options": None if self.reset_options is None else _for_files(self.reset_options),
                 "max_episode_steps": self.max_episode_steps}
        given = {name: rule for name, rule in rules.items() if rule is not None}
        return {"id": self.id, "kwargs": _for_files(self.kwargs), **given}

    @property
    def modules(self) -> list[str]:
        """The names in it that import a module when the environment is made."""
        direct = [name for name in (self.id, self.goal, self.feature) if name is not None and is_module_name(name)]
        return [*direct, *module_names([self.kwargs, self.reset_options])]

    def check_trusted(self, known: Collection[str] = ()) -> None:
        """Refuse to import what a file names.

        Args:
            known: Names that import nothing, because that has happened.

        Raises:
            UntrustedModule: the spec was read from a file, and names a module.
        """
        if not self.trusted:
            refuse_modules(f"a file with the environment {self.label}",
                           (name for name in self.modules if name not in known))

    def as_trusted(self) -> "EnvSpec":
        """Return the same spec, whose modules may be imported."""
        return replace(self, trusted=True)

    @classmethod
    def from_dict(cls, values: Any, *, trusted: bool = False) -> "EnvSpec":
        """Return the spec whose `to_dict` this was.

        Args:
            values: From a file, or from another process.
            trusted: Whether modules that it names may be imported.

        Raises:
            DamagedFile: it was none.
        """
        try:
            msgspec.convert(values, EnvValues)
            return cls(**{name: from_nulls(value) for name, value in values.items()}, trusted=trusted)
        except (TypeError, InvalidOption, msgspec.ValidationError) as error:
            raise DamagedFile(f"the environment {values!r} is damaged: {error}") from error

    def same_as(self, other: "EnvSpec") -> bool:
        """Return whether both make the same model: arrays, tuples and lists of the same numbers are equal."""
        return self.to_dict() == other.to_dict()

    def __str__(self) -> str:
        return self.label


def _check_integer(name: str, value: Any, least: int) -> None:
    if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < least):
        raise InvalidOption(f"{name} is {value!r}; expected an integer >= {least}")


def _for_files(options: dict[str, Any]) -> Any:
    return to_nulls(json.loads(json.dumps(options, default=plain)))


def _compact(value: Any) -> str:
    """Return an option's value in a name: JSON, but that a string which cannot be mistaken for more goes unquoted."""
    text = json.dumps(value, default=plain, separators=(",", ":"))
    plainly = isinstance(value, str) and value == value.strip() and text == f'"{value}"' and "," not in value
    return str(value) if plainly and not _is_json(value) else text


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except ValueError:
        return False
    return True
