"""The arguments of a public function are what its annotations say: the one check of types at the border."""

import inspect
import reprlib
import sys
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cache, wraps
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from pbcs_ompl.core.errors import InvalidOption

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")
NUMBERS = {int: Integral, float: Real}


def checked(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Refuse arguments whose type is not that of the annotation.

    Integers serve as floats, numbers of NumPy as those of Python, booleans as neither.

    Raises:
        InvalidOption: names the argument, what was given, and what is expected.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def call(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        hints = _hints(function)
        for name, value in signature.bind(*args, **kwargs).arguments.items():
            if name in hints and signature.parameters[name].kind is not inspect.Parameter.VAR_KEYWORD:
                check_type(name, value, hints[name])
        return function(*args, **kwargs)

    return call


def check_type(name: str, value: Any, hint: Any) -> None:
    """Refuse a value of another type than an annotation.

    Raises:
        InvalidOption: it has.
    """
    if not fits(value, hint):
        raise InvalidOption(f"{name} is {short_repr(value)}; expected {words(hint)}")


def check_fields(instance: Any) -> None:
    """Refuse fields of a dataclass whose type is not that of the annotation.

    Raises:
        InvalidOption: names the first.
    """
    for name, hint in _hints(instance.__class__).items():
        check_type(name, getattr(instance, name), hint)


@cache
def _hints(owner: Hashable) -> dict[str, Any]:
    return {name: hint for name, hint in get_type_hints(owner).items() if name != "return"}


def fits(value: Any, hint: Any) -> bool:
    """Return whether a value has the type of an annotation, as far as that can be seen."""
    return _test_of(hint)(value)


@cache
def _test_of(hint: Any) -> Callable[[Any], bool]:
    """Return the test of an annotation, which is taken apart once."""
    origin, parameters = get_origin(hint), get_args(hint)
    if hint is Any or isinstance(hint, TypeVar) or getattr(hint, "_is_protocol", False):
        return lambda value: True
    if hint is None or hint is NoneType:
        return lambda value: value is None
    if origin in (Union, UnionType):
        return lambda value: any(fits(value, one) for one in parameters)
    if origin is Literal:
        return lambda value: value in parameters
    if origin is not None and issubclass(origin, Mapping):
        return lambda value: isinstance(value, origin) and all(
            fits(key, parameters[0]) and fits(item, parameters[1]) for key, item in value.items())
    if origin is not None and issubclass(origin, Sequence) and origin is not tuple:
        return lambda value: _is_list(value, origin) and all(fits(item, parameters[0]) for item in value)
    return lambda value: _has_class(value, origin or hint)


def _has_class(value: Any, kind: Any) -> bool:
    """Return whether a value is an instance; numbers of NumPy are numbers, and booleans are none."""
    if kind is Callable:
        return callable(value)
    if kind in NUMBERS:
        return isinstance(value, NUMBERS[kind]) and not _is_bool(value)
    if kind is bool:
        return _is_bool(value)
    return isinstance(value, kind)


def _is_list(value: Any, kind: type) -> bool:
    return isinstance(value, (kind, *_of_numpy("ndarray"))) and not isinstance(value, str | bytes)


def _is_bool(value: Any) -> bool:
    return isinstance(value, (bool, *_of_numpy("bool_")))


def _of_numpy(name: str) -> tuple[type, ...]:
    """Return a type of NumPy, where that is imported: the command line needs none for its help."""
    numpy = sys.modules.get("numpy")
    return () if numpy is None else (getattr(numpy, name),)


def words(hint: Any) -> str:
    """Return an annotation in words, as "int or None"."""
    origin, parameters = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(words(one) for one in parameters))
    if origin is Literal:
        return " or ".join(map(repr, parameters))
    if origin is Callable or hint is Callable:
        return "a function"
    if origin is not None and issubclass(origin, Mapping):
        return f"{origin.__name__} of {words(parameters[0])} to {words(parameters[1])}"
    if origin is not None and issubclass(origin, Sequence):
        return f"{origin.__name__} of {words(parameters[0])}"
    if hint is NoneType:
        return "None"
    return "anything" if hint is Any else getattr(origin or hint, "__name__", str(hint))


def short_repr(value: Any) -> str:
    """Return the representation of a value, shortened; its type where it has none."""
    try:
        return reprlib.repr(value)
    except Exception:  # its __repr__ is code of others
        return f"a {type(value).__name__}"
