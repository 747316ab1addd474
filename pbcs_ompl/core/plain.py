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
