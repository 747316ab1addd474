"""What an environment with `get_env_state` and `set_env_state` keeps in attributes beside the state that it returns."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import NotResettable
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap, copied
from pbcs_ompl.resettable.memory.code import names_of
from pbcs_ompl.resettable.memory.exploration import Changes, episodes, refuse_random
from pbcs_ompl.resettable.memory.generators import states
from pbcs_ompl.resettable.memory.owned import Path, find, look, put, text_of
from pbcs_ompl.resettable.memory.plain_values import same
from pbcs_ompl.resettable.rules import SUCCESS
from pbcs_ompl.resettable.task_env import bare

STEPS = 20
FAR = (1, 1_000_000, -1_000_000)
"""What is added to a number to see whether anything depends on it."""


def refuse_uncovered(env: Any) -> None:
    """Refuse an environment whose steps read attributes that they change and `set_env_state` does not set.

    An attribute that no method reads, that is set before it is read, or that only counts, is no state.

    Args:
        env: The environment without wrappers; it is reset and stepped.

    Raises:
        NotResettable: there is such an attribute, or steps draw random numbers from a generator that
            `set_env_state` does not set back; says which.
    """
    env.reset(seed=0)
    changes = Changes(env)
    for event in episodes(env):
        changes.add(event)
    if changes.random and not _sets_generator(env, changes.random):
        refuse_random(bare(env), changes)
    names = names_of({type(owner) for owner in changes.owned.owners.values()}, ("step",))
    for path, seen in changes.plain.items():
        name = next(step.key for step in reversed(path) if not step.is_item)
        is_read = name in names.loaded or not names.loaded
        if (seen.in_step or name in names.stored) and is_read and _matters(env, path):
            raise NotResettable(f"{type(bare(env)).__name__} is not resettable: its steps change the attribute "
                                f"{text_of(path)!r} and read it, and set_env_state does not set it; make it part of "
                                f"what get_env_state returns")


def _sets_generator(env: Any, name: str) -> bool:
    """Return whether `set_env_state` sets the generator of a name back, whatever was drawn from it."""
    state = _middle(env)
    drawn = []
    for _ in range(2):
        env.set_env_state(state.copy())
        drawn.append(states(look(bare(env)).generators)[name])
        for action in _actions(env)[:STEPS // 2]:
            if any(env.step(copied(action))[2:4]):
                break
    return drawn[0] == drawn[1]


def _matters(env: Any, path: Path) -> bool:
    try:
        return not _is_set(env, path) and _is_read_first(env, path) and not _only_counts(env, path)
    except (AttributeError, LookupError):  # it is not there in some states
        return False


def _is_set(env: Any, path: Path) -> bool:
    """Return whether `set_env_state` gives the value at a path back, whatever it was before."""
    state = _middle(env)
    env.set_env_state(state.copy())
    expected = _plain(env, path)
    if type(expected) in (bool, int, float) or isinstance(expected, np.ndarray | np.generic):
        put(bare(env), path, _another(expected))
    else:
        for action in _actions(env)[:STEPS // 2]:
            if any(env.step(copied(action))[2:4]):
                break
        if same(expected, _plain(env, path)):
            return True  # nothing has changed it, so it cannot be seen
    env.set_env_state(state.copy())
    return same(expected, _plain(env, path))


def _is_read_first(env: Any, path: Path) -> bool:
    """Return whether a step reads an attribute of `env` before it sets it; True for those of other objects."""
    attribute, *others = path
    if others:
        return True
    read_first = False
    env.reset(seed=0)
    for action in _actions(env):
        with _traced(bare(env), attribute.key) as uses:
            _, _, terminated, truncated, _ = env.step(copied(action))
        if uses is None or (uses and uses[0] == "read"):
            read_first = True
        if terminated or truncated:
            break
    return read_first


def _only_counts(env: Any, path: Path) -> bool:
    """Return whether a number has no influence on anything but itself, however far off it is."""
    state = _middle(env)
    env.set_env_state(state.copy())
    value = find(bare(env), path)
    if type(value) not in (int, float) and not isinstance(value, np.integer | np.floating):
        return False
    expected = _reported(env, state, path, value)
    return all(_reported(env, state, path, type(value)(value + far)) == expected for far in FAR)


def _reported(env: Any, state: Array, path: Path, value: Any) -> list[tuple[Any, ...]]:
    """Return what steps report from a state, with a value at a path."""
    env.set_env_state(state.copy())
    put(bare(env), path, value)
    reports = []
    for action in _actions(env):
        observation, reward, terminated, truncated, info = env.step(copied(action))
        success = [str(info.get(key)) for key in SUCCESS]
        reports.append((np.array(observation).tobytes(), float(reward), bool(terminated), bool(truncated), *success,
                        np.array(env.get_env_state(), dtype=np.float64).tobytes()))
        if terminated or truncated:
            break
    put(bare(env), path, value)
    return reports


def _middle(env: Any) -> Array:
    """Return a state in the middle of an episode."""
    env.reset(seed=0)
    state = np.array(env.get_env_state(), dtype=np.float64)
    for action in _actions(env)[:STEPS // 4]:
        if any(env.step(copied(action))[2:4]):
            return state
        state = np.array(env.get_env_state(), dtype=np.float64)
    return state


def _actions(env: Any) -> list[Any]:
    actions, rng = ActionMap.of(env.action_space), np.random.default_rng(2)
    return list(actions.to_actions(rng.uniform(actions.low, actions.high, (STEPS, len(actions.low)))))


def _plain(env: Any, path: Path) -> Any:
    return look(bare(env)).plain[path]


def _another(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return ~value if value.dtype.kind == "b" else value + value.dtype.type(1)
    return type(value)(not value) if isinstance(value, bool | np.bool_) else type(value)(value + 1)


@contextmanager
def _traced(env: Any, name: str) -> Iterator[list[str] | None]:
    """Note how an attribute of `env` is used; None where its class does not allow that."""
    env = bare(env)
    kind, uses = type(env), list[str]()

    class Traced(kind):  # type: ignore[misc, valid-type]
        def __getattribute__(self, attribute: str) -> Any:
            if attribute == name:
                uses.append("read")
            return super().__getattribute__(attribute)

        def __setattr__(self, attribute: str, value: Any) -> None:
            if attribute == name:
                uses.append("set")
            super().__setattr__(attribute, value)

    try:
        env.__class__ = Traced
    except TypeError:
        yield None
        return
    try:
        yield uses
    finally:
        env.__class__ = kind
