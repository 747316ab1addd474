"""Plain values, as attributes hold them, and their form as numbers of a state vector.

Plain are numbers, flags, strings, None, arrays of these, members of an `Enum`, and lists, tuples, dictionaries, sets
and deques of plain values. Their text is JSON, in which each value has its type beside it, three bytes a number: the
same in every process.
"""

import json
from collections import deque
from collections.abc import Iterator
from enum import Enum
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidState, NotResettable
from pbcs_ompl.core.types import Array

SCALARS: tuple[type, ...] = (bool, int, float)
BYTES = 3
"""Bytes in one number of a state: less than 2**24, so within the bounds that a state has."""
DEEPEST = 8
CONTAINERS: dict[str, Any] = {"list": list, "tuple": tuple, "set": set, "frozenset": frozenset}
NAMES = {kind: name for name, kind in CONTAINERS.items()}


def is_plain(value: Any, depth: int = 0) -> bool:
    """Return whether a value is plain all the way down."""
    if value is None or type(value) in (bool, int, float, str, bytes) or isinstance(value, np.generic | Enum):
        return True
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "biufSU"
    return type(value) in (*NAMES, dict, deque) and depth < DEEPEST and all(
        is_plain(part, depth + 1) for part in _parts(value))


def enums_of(value: Any) -> Iterator[type[Enum]]:
    """Yield the classes of the members of an `Enum` in a plain value."""
    if isinstance(value, Enum):
        yield type(value)
    elif type(value) in (*NAMES, dict, deque):
        for part in _parts(value):
            yield from enums_of(part)


def same(one: Any, other: Any) -> bool:
    """Return whether two plain values are equal, types included."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return bool(one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes())
    return one == other if type(one) in (bool, int, str, type(None)) else to_text(one) == to_text(other)


def to_text(value: Any) -> bytes:
    """Return a plain value as JSON."""
    return json.dumps(_node(value), separators=(",", ":")).encode()


def from_text(text: bytes, enums: dict[str, type[Enum]]) -> Any:
    """Return the plain value of a JSON text.

    Args:
        text: What `to_text` returned.
        enums: The known classes of `Enum`, by name.

    Raises:
        InvalidState: it is no such text.
    """
    try:
        return _value(json.loads(text), enums)
    except (ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
        raise InvalidState(f"the state holds no value that the environment had: {error!r}") from error


def pack(text: bytes, size: int, name: str) -> Array:
    """Return a text as numbers [size]: its length, three bytes in each of the others.

    Raises:
        NotResettable: it is longer than the numbers hold.
    """
    if len(text) > BYTES * (size - 1):
        raise NotResettable(f"{name} needs {len(text)} bytes, more than the {BYTES * (size - 1)} that a state has for "
                            f"it: it grows while the environment runs; bound it, or leave it out of what steps read")
    padded = np.frombuffer(text.ljust(BYTES * (size - 1), b"\0"), dtype=np.uint8).reshape(-1, BYTES)
    return np.concatenate([[float(len(text))], padded @ np.array([1.0, 256.0, 65536.0])])


def unpack(numbers: Array) -> bytes:
    """Return the text of numbers.

    Raises:
        InvalidState: they hold none.
    """
    length, packed = numbers[0], numbers[1:].astype(np.int64)
    if not (0 <= length <= BYTES * len(packed) and (packed >= 0).all() and (packed < 256**BYTES).all()):
        raise InvalidState("the state holds no value that the environment had")
    return np.stack([packed, packed >> 8, packed >> 16], axis=1).astype(np.uint8).tobytes()[:int(length)]


def size_for(length: int) -> int:
    """Return how many numbers hold a text of a length."""
    return 1 + -(-length // BYTES)


def enum_name(kind: type[Enum]) -> str:
    """Return the name under which a class of `Enum` is stored."""
    return f"{kind.__module__}:{kind.__qualname__}"


def _parts(value: Any) -> Any:
    return [*value.keys(), *value.values()] if type(value) is dict else value


def _node(value: Any) -> Any:
    """Return a plain value in JSON's types: scalars of Python as they are, others as [type, ...]."""
    kind = type(value)
    if value is None or kind in (bool, int, float, str):
        return value
    if isinstance(value, Enum):
        return ["enum", enum_name(kind), value.name]
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        numbers = array.astype(str) if array.dtype.kind == "S" else array
        return ["array" if isinstance(value, np.ndarray) else "number", array.dtype.str, array.shape,
                numbers.ravel().tolist()]
    if kind is bytes:
        return ["bytes", value.hex()]
    if kind is dict:
        return ["dict", [[_node(key), _node(part)] for key, part in value.items()]]
    if kind is deque:
        return ["deque", value.maxlen, [_node(part) for part in value]]
    parts = [_node(part) for part in value]
    return [NAMES[kind], sorted(parts, key=json.dumps) if kind in (set, frozenset) else parts]


def _value(node: Any, enums: dict[str, type[Enum]]) -> Any:
    if not isinstance(node, list):
        return node
    kind, *rest = node
    if kind == "enum":
        return enums[rest[0]][rest[1]]
    if kind in ("array", "number"):
        array = np.array(rest[2], dtype=rest[0]).reshape(rest[1])
        return array if kind == "array" else array[()]
    if kind == "bytes":
        return bytes.fromhex(rest[0])
    if kind == "dict":
        return {_value(key, enums): _value(part, enums) for key, part in rest[0]}
    if kind == "deque":
        return deque((_value(part, enums) for part in rest[1]), maxlen=rest[0])
    return CONTAINERS[kind](_value(part, enums) for part in rest[0])
