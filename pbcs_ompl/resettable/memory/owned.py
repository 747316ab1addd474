"""What an environment owns: the values of its attributes, and of the objects in them."""

import functools
import random
import sys
import types
from collections import deque
from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from pbcs_ompl.resettable.memory.plain_values import is_plain
from pbcs_ompl.resettable.task_env import bare

NOT_STATE = frozenset({"np_random", "_np_random", "_np_random_seed", "spec", "metadata", "action_space",
                       "observation_space", "render_mode", "mujoco_renderer", "_ezpickle_args", "_ezpickle_kwargs"})
"""Attributes that every environment may have and that no step depends on; generators are looked at by themselves."""
LIBRARIES = frozenset({"numpy", "gymnasium", "mujoco", "glfw", "OpenGL", "pygame", "PIL", "cv2", "imageio",
                       "matplotlib", "logging", "numba", "xml"})
"""Packages whose objects are no state of an environment: spaces, renderers, logs. Generators are looked at apart."""
SIMULATION = "dm_control.mujoco"
"""The package whose objects are MuJoCo's model and data, which are saved as such."""
DEEPEST = 6
MOST_OBJECTS = 2000
GENERATORS = (np.random.Generator, np.random.RandomState, np.random.BitGenerator, random.Random)
FUNCTIONS = (types.ModuleType, types.FunctionType, types.BuiltinFunctionType, types.MethodType, type,
             functools.partial, property, staticmethod, classmethod)


class Step(NamedTuple):
    """One step of the way to a value: the attribute of an object, or the item of a list or dictionary."""

    key: Any
    is_item: bool = False


Path = tuple[Step, ...]


def text_of(path: Path) -> str:
    """Return a path as one writes it: `robot.arms[0].force`."""
    parts = [f"[{step.key!r}]" if step.is_item else f".{step.key}" for step in path]
    return "".join(parts).lstrip(".")


class Owned(NamedTuple):
    """The values that an environment owns, by path."""

    plain: dict[Path, Any]
    opaque: dict[Path, Any]
    """What is neither plain nor an object with attributes: iterators, files, objects of compiled libraries."""
    generators: dict[Path, Any]
    owners: dict[Path, Any]
    """The objects that have the attributes: the environment itself is at the empty path."""


def look(root: Any) -> Owned:
    """Return what `root`, below its wrappers, owns; each object once, at the first way that leads to it."""
    root = bare(root)
    owned = Owned({}, {}, {}, {(): root})
    seen = {id(root)}
    waiting: deque[tuple[Path, Any]] = deque([((), root)])
    while waiting and len(seen) < MOST_OBJECTS:
        path, owner = waiting.popleft()
        for step, value in _inside(owner):
            if not step.is_item and step.key in NOT_STATE and not isinstance(value, GENERATORS):
                continue
            where = (*path, step)
            if is_plain(value):
                owned.plain[where] = value
            elif isinstance(value, GENERATORS):
                owned.generators[where] = value
            elif not _is_foreign(value) and id(value) not in seen:
                seen.add(id(value))
                if _has_inside(value) and len(where) < DEEPEST:
                    owned.owners[where] = value
                    waiting.append((where, value))
                else:
                    owned.opaque[where] = value
    return owned


def holds_resource(root: Any) -> bool:
    """Return whether `root` owns an object that releases something when it is deleted, as a connection to a server.

    A deep copy of it, when it is deleted, would release what the original holds.
    """
    owned = look(root)
    return any(hasattr(type(value), "__del__") for value in (*owned.owners.values(), *owned.opaque.values()))


def find(root: Any, path: Path) -> Any:
    """Return the value at a path.

    Raises:
        AttributeError, LookupError: there is none.
    """
    root = bare(root)
    for key, is_item in path:
        root = root[key] if is_item else getattr(root, key)
    return root


def finder(path: Path) -> Callable[[Any], Any]:
    """Return `find` for one path, as fast as it can be, of environments without wrappers."""
    if not path:
        return lambda root: root
    if any(step.is_item for step in path):
        return lambda root: find(root, path)
    return attrgetter(".".join(step.key for step in path))


def put(root: Any, path: Path, value: Any) -> None:
    """Set the value at a path."""
    set_part(find(root, path[:-1]), path[-1], value)


def set_part(owner: Any, step: Step, value: Any) -> None:
    """Set an attribute or item of an object."""
    if step.is_item:
        owner[step.key] = value
    else:
        object.__setattr__(owner, step.key, value)


def remove(root: Any, path: Path) -> None:
    """Delete the value at a path, if there is one."""
    owner, (key, is_item) = find(root, path[:-1]), path[-1]
    if is_item:
        owner.pop(key, None)
    elif hasattr(owner, key):
        object.__delattr__(owner, key)


def _inside(owner: Any) -> Iterator[tuple[Step, Any]]:
    if isinstance(owner, dict):
        yield from ((Step(key, is_item=True), value) for key, value in list(owner.items()))
    elif isinstance(owner, list | tuple | deque):
        yield from ((Step(index, is_item=True), value) for index, value in enumerate(owner))
    else:
        yield from ((Step(name), value) for name, value in _attributes(owner))


def _attributes(owner: Any) -> Iterator[tuple[str, Any]]:
    yield from list(getattr(owner, "__dict__", {}).items())
    for kind in type(owner).__mro__:
        slots = vars(kind).get("__slots__", ())
        for name in (slots,) if isinstance(slots, str) else slots:
            if name not in ("__dict__", "__weakref__") and hasattr(owner, name):
                yield name, getattr(owner, name)


def _has_inside(value: Any) -> bool:
    if isinstance(value, list | tuple | deque | dict):
        return True
    kind = type(value)
    compiled = sys.modules.get(_module_of(kind)) is None or "__module__" not in vars(kind)
    return not compiled and (hasattr(value, "__dict__") or any("__slots__" in vars(base) for base in kind.__mro__))


def _is_foreign(value: Any) -> bool:
    """Return whether a value is a function, or an object of a library that is no environment."""
    module = _module_of(type(value))
    if isinstance(value, FUNCTIONS) or module.startswith(SIMULATION):
        return True
    if isinstance(value, gymnasium.Env) or type(value).__name__ == "MjData":
        return False
    return module.partition(".")[0] in LIBRARIES


def _module_of(kind: type) -> str:
    """Return the name of a class's module; those that SWIG compiles may have none."""
    return str(getattr(kind, "__module__", ""))
