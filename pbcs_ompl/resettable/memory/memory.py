"""The memory of an environment: its attributes that change, as numbers [M] of a state."""

import math
from collections.abc import Iterable, Mapping
from copy import copy, deepcopy
from enum import Enum
from itertools import pairwise
from typing import Any, Self

import numpy as np

from pbcs_ompl.core.errors import InvalidState, NotResettable
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.memory.code import names_of
from pbcs_ompl.resettable.memory.exploration import ABSENT, Changes, Seen, kind_of, refuse_opaque, refuse_random
from pbcs_ompl.resettable.memory.owned import Path, find, finder, look, put, remove, set_part, text_of
from pbcs_ompl.resettable.memory.plain_values import (
    enum_name,
    enums_of,
    from_text,
    pack,
    same,
    size_for,
    to_text,
    unpack,
)
from pbcs_ompl.resettable.task_env import bare

LARGEST = 4096
"""Numbers that one attribute may add to a state."""
SMALLEST_TEXT = 24
FIRST_METHODS = ("reset", "step", "_get_obs")


class Memory:
    """Saves and restores what an environment keeps in attributes: its own, and those of the objects it owns.

    That is what has changed while the environment was explored, and what its methods set, whether it has changed or
    not; see `code`. All else is taken for constant; see `check_constants`.

    Args:
        env: The environment.
        changes: What has changed in it; see `exploration`.
        before: What it owned before anything ran in it: copies of plain values, by path.
        besides: The first attributes of paths that are saved in another way.
        known: Objects that are saved in another way, wherever they are.

    Raises:
        NotResettable: steps draw random numbers, or something that changes is no plain value; says its name.
    """

    def __init__(self, env: Any, changes: Changes, before: Mapping[Path, Any], besides: Iterable[str] = (),
                 known: Iterable[Any] = ()):
        refuse_random(bare(env), changes)
        self._env, self._besides = bare(env), frozenset(besides)
        self._names = names_of({type(owner) for owner in changes.owned.owners.values()}, FIRST_METHODS)
        saved = {id(value) for value in known}
        for path, value in changes.opaque.items():
            if path[0].key not in self._besides and id(value) not in saved and not self._is_unread(path):
                refuse_opaque(self._env, path, value)
        chosen = {path: seen for path, seen in changes.plain.items() if self._is_variable(path, seen)}
        self._variables = [_Variable(self._env, path, seen)
                           for path, seen in sorted(chosen.items(), key=lambda item: str(item[0]))
                           if not (self._is_unread(path) and _is_growing(seen))]
        self._enums = {enum_name(kind): kind for path in chosen for value in [changes.owned.plain.get(path)]
                       for kind in enums_of(value)}
        ends = np.cumsum([0, *(variable.size for variable in self._variables)]).tolist()
        self._places, self.size = [slice(*ends_of) for ends_of in pairwise(ends)], ends[-1]
        self._constants = {path: seen.last for path, seen in changes.plain.items()
                           if path not in chosen and path[0].key not in self._besides and not self._is_unread(path)}
        self._before = {variable.path: before.get(variable.path, ABSENT) for variable in self._variables}
        self._shared = [(variable.path, first) for variable in self._variables
                        if (first := changes.first_name(variable.path)) is not None and first in chosen]

    def of(self, env: Any) -> Self:
        """Return the memory of another instance of the environment."""
        other = copy(self)
        other._env = bare(env)
        return other

    @property
    def names(self) -> list[str]:
        """The attributes that are saved."""
        return [text_of(variable.path) for variable in self._variables]

    def save(self) -> Array:
        """Return the attributes as numbers [M]."""
        saved = np.empty(self.size)
        for place, variable in zip(self._places, self._variables, strict=True):
            saved[place] = variable.save(self._env)
        return saved

    def load(self, numbers: Array) -> None:
        """Set the attributes to what `save` returned.

        Raises:
            InvalidState: the numbers are no such values.
        """
        for place, variable in zip(self._places, self._variables, strict=True):
            variable.load(self._env, numbers[place], self._enums)
        for path, first in self._shared:
            put(self._env, path, find(self._env, first))

    def clear(self) -> None:
        """Set the attributes to what they were before anything ran, so that a reset does what it does first."""
        for path, value in self._before.items():
            try:
                if value is ABSENT:
                    remove(self._env, path)
                else:
                    put(self._env, path, deepcopy(value))
            except (AttributeError, LookupError):  # a reset makes the object that has it
                continue

    def values(self, env: Any) -> dict[str, Any]:
        """Return the attributes of another environment of the same class, by name."""
        return {text_of(variable.path): variable.read(bare(env)) for variable in self._variables}

    def check_constants(self) -> None:
        """Refuse the environment if an attribute has changed that exploration has not seen changing.

        Raises:
            NotResettable: says its name.
        """
        now = look(self._env).plain
        for path, value in self._constants.items():
            if path in now and not same(value, now[path]):
                raise NotResettable(f"{type(self._env).__name__} is not resettable: its attribute {text_of(path)!r} "
                                    f"has changed, which neither its code nor some hundred steps have shown; set it in "
                                    f"`reset` or `step`, in code that can be read")

    def _is_variable(self, path: Path, seen: Seen) -> bool:
        if path[0].key in self._besides:
            return False
        small = not isinstance(seen.last, np.ndarray) or seen.last.size <= LARGEST // 4
        return seen.changes or (small and _attribute(path) in self._names.stored)

    def _is_unread(self, path: Path) -> bool:
        """Return whether no method reads the attribute at a path."""
        return bool(self._names.loaded) and _attribute(path) not in self._names.loaded


class _Variable:
    """One attribute: a number, an array of fixed shape, or a text of bounded length."""

    def __init__(self, env: Any, path: Path, seen: Seen):
        self.path = path
        self._find, self._find_owner, self._last = finder(path), finder(path[:-1]), path[-1]
        self._name = f"{type(bare(env)).__name__}: the attribute {text_of(path)!r}"
        self._kind = next(iter(seen.kinds)) if len(seen.kinds) == 1 else None
        self._in_place = seen.is_one_object and isinstance(seen.object, np.ndarray)
        if self._kind is None:
            self.size = size_for(max(SMALLEST_TEXT, 4 * seen.longest))
        else:
            self.size = int(np.prod(self._kind[1])) if isinstance(self._kind, tuple) else 1
        if self.size > LARGEST:
            raise NotResettable(f"{self._name} takes {self.size} numbers in every state, more than {LARGEST}; keep "
                                f"less in it, or implement get_env_state and set_env_state")

    def read(self, env: Any) -> Any:
        """Return the value."""
        try:
            return self._find(env)
        except (AttributeError, LookupError):
            return ABSENT

    def save(self, env: Any) -> Any:
        """Return the value as numbers, or as the only one."""
        value = self.read(env)
        if self._kind is None:
            return pack(b"" if value is ABSENT else self._text(value), self.size, self._name)
        if not self._fits(value):
            raise NotResettable(f"{self._name} has changed its type or shape from {_describe(self._kind)} to "
                                f"{_describe(kind_of(value) or type(value))}; let it have one of them, from reset on")
        return value.ravel() if isinstance(value, np.ndarray) else value

    def load(self, env: Any, numbers: Array, enums: dict[str, type[Enum]]) -> None:
        """Set the value."""
        if self._kind is None:
            text = unpack(numbers)
            if text:
                set_part(self._find_owner(env), self._last, from_text(text, enums))
            else:
                remove(env, self.path)
        elif not isinstance(self._kind, tuple):
            set_part(self._find_owner(env), self._last, self._scalar(numbers[0]))
        elif self._in_place:
            self._find(env)[...] = numbers.reshape(self._kind[1])
        else:
            set_part(self._find_owner(env), self._last, numbers.reshape(self._kind[1]).astype(self._kind[0]))

    def _fits(self, value: Any) -> bool:
        if isinstance(self._kind, tuple):
            return isinstance(value, np.ndarray) and (value.dtype, value.shape) == self._kind
        return bool(kind_of(value) == self._kind)

    def _scalar(self, number: float) -> Any:
        assert self._kind is not None
        if self._kind in (bool, int) and not math.isfinite(number):
            raise InvalidState(f"{self._name} cannot be {number}")
        return self._kind(number)

    def _text(self, value: Any) -> bytes:
        try:
            return to_text(value)
        except (TypeError, KeyError) as error:
            raise NotResettable(f"{self._name} holds a {type(value).__name__}, which cannot be saved") from error


def _attribute(path: Path) -> Any:
    """Return the name of the last attribute on a path, before items."""
    return next(step.key for step in reversed(path) if not step.is_item)


def _describe(kind: Any) -> str:
    if isinstance(kind, tuple):
        return f"an array of type {kind[0]} and shape {kind[1]}"
    return getattr(kind, "__name__", str(kind))


def _is_growing(seen: Seen) -> bool:
    return type(seen.last) in (list, dict, set) or isinstance(seen.last, np.ndarray)
