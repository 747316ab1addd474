"""Arrays of a file, taken out one by one: there, numbers, of the expected shape, and finite where that matters."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.text_values import parse_json
from pbcs_ompl.results.schema import in_words

FLOATS, INTEGERS, NUMBERS = "f", "iu", "fiub"
"""Kinds of dtypes; what has another kind, such as text or objects, is refused."""


def take(path: Path, arrays: Mapping[str, NDArray[Any]], name: str, shape: tuple[int | None, ...], *,
         kinds: str = FLOATS, finite: bool = True) -> NDArray[Any]:
    """Return an array of a file.

    Args:
        path: The file.
        arrays: What it holds.
        name: Which array.
        shape: The length of each axis; None for any.
        kinds: The kinds of dtypes it may have.
        finite: Whether NaN and infinity are refused.

    Raises:
        DamagedFile: it is not there, or is something else.
    """
    if name not in arrays:
        raise DamagedFile(f"{path} is damaged: it lacks the array {name!r}")
    array = arrays[name]
    fits = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in kinds or not fits:
        expected = ", ".join("any" if length is None else str(length) for length in shape)
        raise DamagedFile(f"{path} is damaged: {name} is {array.dtype} {list(array.shape)}; expected numbers "
                          f"[{expected}]")
    if finite and not np.isfinite(array).all():
        raise DamagedFile(f"{path} is damaged: {name} has values that are not finite")
    return array


def take_words(path: Path, arrays: Mapping[str, NDArray[Any]], name: str, kind: Any, *, finite: bool = True) -> Any:
    """Return the plain values that lie in an array as a JSON text.

    Args:
        path: The file.
        arrays: What it holds.
        name: Which array.
        kind: What the values should be: a type of `results.schema`.
        finite: Whether NaN and infinity are refused.

    Raises:
        DamagedFile: it is not there, or holds something else.
    """
    if name not in arrays or arrays[name].dtype.kind != "U" or arrays[name].shape:
        raise DamagedFile(f"{path} is damaged: it lacks the text {name!r}")
    try:
        values = parse_json(str(arrays[name]), finite=finite)
        msgspec.convert(values, kind)
    except (ValueError, RecursionError) as error:  # msgspec's are ValueErrors
        raise DamagedFile(f"{path} is damaged: its {name} do not parse: {in_words(error)}") from error
    return values
