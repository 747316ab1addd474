"""Exploration: what changes in an environment while it is reset and stepped."""

import io
from collections import deque
from collections.abc import Iterator
from copy import deepcopy
from typing import Any, Literal

import gymnasium
import numpy as np

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.memory.generators import drawn, states
from pbcs_ompl.resettable.memory.owned import Owned, Path, look, text_of
from pbcs_ompl.resettable.memory.plain_values import is_plain, same, to_text
from pbcs_ompl.resettable.task_env import bare

SEEDS = (0, 1, 2, 0)
STEPS = 40
LARGE = 1e8
"""Numbers beyond this, infinity and NaN are saved as text: a state is finite and has bounds."""
HELD = 8
"""Steps for which an action is kept: so an environment gets further than with a new one in each step."""
Event = Literal["reset", "step"]


class Absent:
    """Stands for the value of an attribute that is not there."""


ABSENT = Absent()


class Seen:
    """What was seen of one plain attribute."""

    def __init__(self, value: Any):
        self.object, self.last = value, _copy(value)
        self.kinds = {kind_of(value)}
        self.longest = text_length(value)
        self.in_step = self.in_reset = False
        self.is_one_object = True

    def add(self, value: Any, event: Event) -> None:
        """Compare with the value before, and keep the new one."""
        self.is_one_object = self.is_one_object and value is self.object
        if value is self.last or same(self.last, value):  # that an attribute is absent is no plain value
            return
        self.in_step, self.in_reset = self.in_step or event == "step", self.in_reset or event == "reset"
        self.last = _copy(value)
        self.kinds.add(kind_of(value))
        self.longest = max(self.longest, text_length(value))

    @property
    def changes(self) -> bool:
        """Whether two values differed."""
        return self.in_step or self.in_reset


class Changes:
    """What of an environment has changed, by path; `add` after every reset and step."""

    def __init__(self, env: Any):
        self._env = bare(env)
        self.owned: Owned = look(self._env)
        self._generators = states(self.owned.generators)
        self.plain = {path: Seen(value) for path, value in self.owned.plain.items()}
        self._opaque = {path: (value, fingerprint(value)) for path, value in self.owned.opaque.items()}
        self.opaque: dict[Path, Any] = {}
        """What is not plain, and has changed or been replaced."""
        self.random = ""
        """The generator that steps have drawn from."""
        self._first_names = _first_names(self.owned.plain)

    def add(self, event: Event) -> None:
        """Compare what the environment owns now with what it owned before."""
        self.owned = now = look(self._env)
        earlier, self._generators = self._generators, states(now.generators)
        self.random = self.random or (drawn(earlier, self._generators) if event == "step" else "")
        for path in self.plain.keys() | now.plain.keys():
            value = now.plain.get(path, ABSENT)
            self.plain.setdefault(path, Seen(ABSENT)).add(value, event)
        names = _first_names(now.plain)
        self._first_names = {path: name for path, name in self._first_names.items() if names.get(path) == name}
        for path, value in now.opaque.items():
            before = self._opaque.get(path)
            print_now = fingerprint(value)
            if before is None or before[0] is not value or print_now is None or before[1] != print_now:
                if before is not None or event == "step":
                    self.opaque[path] = value
                self._opaque[path] = (value, print_now)

    def first_name(self, path: Path) -> Path | None:
        """Return the other path that has led to the same object as this one at all times, None where none has."""
        name = self._first_names.get(path, path)
        return None if name == path else name


def _first_names(plain: dict[Path, Any]) -> dict[Path, Path]:
    """Return for each path of an object that can be changed in place the first path that leads to it."""
    first: dict[int, Path] = {}
    return {path: first.setdefault(id(value), path) for path, value in plain.items()
            if type(value) in (np.ndarray, list, dict, set, deque)}


def plain_copies(env: Any) -> dict[Path, Any]:
    """Return copies of the plain values that an environment owns, by path."""
    return {path: deepcopy(value) for path, value in look(bare(env)).plain.items()}


def episodes(env: gymnasium.Env[Any, Any], seeds: tuple[int, ...] = SEEDS, steps: int = STEPS) -> Iterator[Event]:
    """Reset and step an environment, always in the same way; yield after each of both what it was.

    Args:
        env: The environment.
        seeds: Of the resets.
        steps: The most steps after each.
    """
    rng = np.random.default_rng(0)
    actions = ActionMap.of(env.action_space)
    for seed in seeds:
        env.reset(seed=seed)
        yield "reset"
        controls = rng.uniform(actions.low, actions.high, (-(-steps // HELD), len(actions.low)))
        for control in np.repeat(controls, HELD, axis=0)[:steps]:
            _, _, terminated, truncated, _ = env.step(actions.to_action(control))
            yield "step"
            if terminated or truncated:
                break


def refuse_random(env: Any, changes: Changes) -> None:
    """Refuse an environment whose steps draw random numbers.

    Raises:
        NotResettable: they do.
    """
    if changes.random:
        raise NotResettable(f"{type(bare(env)).__name__} is not resettable: its steps draw random numbers from "
                            f"{changes.random}; make the randomness part of its state, or draw all of it in reset")


def refuse_opaque(env: Any, path: Path, value: Any) -> None:
    """Refuse an environment because of what it keeps at a path.

    Raises:
        NotResettable: always.
    """
    raise NotResettable(f"{type(bare(env)).__name__} is not resettable: it keeps a {type(value).__name__} in its "
                        f"attribute {text_of(path)!r}, which changes and cannot be saved; keep numbers, arrays, flags, "
                        f"or lists and dictionaries of them instead")


def fingerprint(value: Any) -> Any:
    """Return what changes if an opaque value does; None where that cannot be seen, and it can only change."""
    if isinstance(value, io.IOBase):
        return value.seek(0, io.SEEK_CUR) if not value.closed and value.readable() and value.seekable() else id(value)
    if hasattr(value, "qpos") and hasattr(value, "time"):  # a simulation of MuJoCo
        return value.time, value.qpos.tobytes()
    return None if hasattr(value, "__next__") else id(value)


def kind_of(value: Any) -> Any:
    """Return the type of a scalar, type and shape of an array, None for what is no fixed number of finite numbers."""
    kind = type(value)
    if kind is float or kind is int or kind is bool:
        return kind if -LARGE < value < LARGE else None
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        return kind if -LARGE < float(value) < LARGE else None
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return (value.dtype, value.shape) if np.isfinite(value).all() else None
    return None


def text_length(value: Any) -> int:
    """Return the length of a value as text."""
    if isinstance(value, np.ndarray):
        return 40 + 24 * value.size
    return 1 if value is ABSENT else len(to_text(value))


def _copy(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.copy()
    if value is ABSENT:
        return value
    return deepcopy(value) if type(value) in (list, tuple, dict, set) or not is_plain(value) else value
