"""Which attributes the methods of a class set and read, from their bytecode: no source is needed."""

import dis
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from types import CodeType
from typing import Any, NamedTuple

CHANGES = frozenset({"append", "appendleft", "add", "extend", "insert", "update", "pop", "popleft", "popitem", "remove",
                     "discard", "clear", "setdefault", "sort", "reverse", "rotate", "fill", "put", "resize"})
"""Methods that change the object whose method they are."""
ONLY_ADD = frozenset({"append", "appendleft", "add", "extend"})
LOADS = ("LOAD_ATTR", "LOAD_METHOD")
UNRELATED = ("render", "close", "__init__", "__del__", "__repr__", "__str__")


class Names(NamedTuple):
    """Names of attributes, of whatever object, in some methods."""

    stored: frozenset[str]
    """Set, or changed in place."""
    loaded: frozenset[str]
    """Read, other than to add something to them."""


def names_of(kinds: Iterable[type], first: Iterable[str]) -> Names:
    """Return the names that methods of classes set and read; none for those that are compiled.

    Args:
        kinds: The classes.
        first: The methods to begin with. What they call follows, of whichever of the classes has a method of that name;
            what renders, makes or closes an object is left out.
    """
    known = set(kinds)
    methods = {name for kind in known for base in kind.__mro__ if base is not object for name in vars(base)
               if _is_related(name)}
    waiting = methods & set(first)
    done: set[str] = set()
    stored: set[str] = set()
    loaded: set[str] = set()
    while waiting:
        done.add(name := waiting.pop())
        for ours in (_names_in(code) for kind in known for code in _codes(kind, name)):
            stored |= ours.stored
            loaded |= ours.loaded
        waiting |= (loaded & methods) - done
    return Names(frozenset(stored), frozenset(loaded))


def _is_related(name: str) -> bool:
    return not any(word in name for word in UNRELATED)


def _codes(kind: type, name: str) -> Iterator[CodeType]:
    """Yield the code of all methods and properties of a name, those of parents too."""
    for base in kind.__mro__:
        for function in _functions(vars(base).get(name)):
            code = getattr(function, "__code__", None)
            if code is not None and base is not object:
                yield from _nested(code)


def _functions(member: Any) -> list[Callable[..., Any] | None]:
    if isinstance(member, property):
        return [member.fget, member.fset]
    return [getattr(member, "__wrapped__", getattr(member, "__func__", member))]


def _nested(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _nested(constant)


@cache
def _names_in(code: CodeType) -> Names:
    stored, loaded = set(), set()
    on_line: dict[int | None, list[str]] = {}
    steps = [step for step in dis.get_instructions(code) if step.opname not in ("CACHE", "PUSH_NULL")]
    for step, following in zip(steps, [*steps[1:], None], strict=True):
        line = step.positions.lineno if step.positions else None
        if step.opname == "STORE_ATTR":
            stored.add(step.argval)
        elif step.opname.startswith(("STORE_SUBSCR", "DELETE_SUBSCR", "STORE_SLICE", "BINARY_OP")):
            in_place = step.opname != "BINARY_OP" or step.argrepr.endswith("=")
            stored.update(on_line.get(line, []) if in_place else [])
        elif step.opname in LOADS or step.opname.startswith(("LOAD_SUPER_ATTR", "LOAD_FAST_LOAD")):
            method = following.argval if following is not None and following.opname in LOADS else None
            on_line.setdefault(line, []).append(step.argval)
            if method in CHANGES:
                stored.add(step.argval)
            if method not in ONLY_ADD:
                loaded.add(step.argval)
    return Names(frozenset(stored), frozenset(name for name in loaded if isinstance(name, str)))
