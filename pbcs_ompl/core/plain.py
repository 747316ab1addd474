"""NumPy values and paths as what JSON and TOML know."""

from pathlib import Path
from typing import Any


def plain(value: Any) -> Any:
    """Return a NumPy value, a path or a set as plain values: the `default` of `json.dumps`.

    Raises:
        TypeError: it is none of these.
    """
    import numpy as np  # the command line needs none for its help

    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, frozenset | set):
        return sorted(value)
    raise TypeError(f"cannot write {type(value).__name__} as JSON")


NULL = {"__null__": True}
"""What stands for None in the options that files hold, since TOML has no null."""


def to_nulls(value: Any) -> Any:
    """Return plain values in which `NULL` stands for None."""
    if isinstance(value, dict):
        return {name: to_nulls(item) for name, item in value.items()}
    if isinstance(value, list):
        return [to_nulls(item) for item in value]
    return dict(NULL) if value is None else value


def from_nulls(value: Any) -> Any:
    """Return what `to_nulls` was given."""
    if value == NULL:
        return None
    if isinstance(value, dict):
        return {name: from_nulls(item) for name, item in value.items()}
    return [from_nulls(item) for item in value] if isinstance(value, list) else value
