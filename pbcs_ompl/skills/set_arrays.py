"""Activation sets and goals as named arrays, to be written without pickle."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.skills.classifier_set import ClassifierSet
from pbcs_ompl.skills.goals import Ball, Target

KINDS: dict[str, type[Any]] = {"ball": Ball, "classifier": ClassifierSet, "target": Target}


def kind_of(part: Any) -> str:
    """Return the name of the kind of a set or goal: "ball", "classifier" or "target"."""
    return next(name for name, kind in KINDS.items() if type(part) is kind)


def to_arrays(part: Any, name: str) -> dict[str, np.ndarray]:
    """Return the attributes of a set or goal, arrays and numbers, as arrays called "<name>.<attribute>"."""
    return {f"{name}.{field.name}": np.asarray(getattr(part, field.name)) for field in fields(part)}


def from_arrays(kind: str, arrays: Mapping[str, np.ndarray], name: str) -> Any:
    """Return what `to_arrays` was given.

    Raises:
        DamagedFile: an array is missing, or there is no such kind.
    """
    try:
        values = {field.name: arrays[f"{name}.{field.name}"] for field in fields(KINDS[kind])}
    except KeyError as error:
        raise DamagedFile(f"{name}, a set of the kind {kind!r}, lacks {error}") from error
    return KINDS[kind](**{key: value if value.ndim else float(value) for key, value in values.items()})
