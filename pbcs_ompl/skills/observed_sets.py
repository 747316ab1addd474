"""Where a skill starts, seen from outside: activation sets as functions of the observation.

Training works on states. A controller outside of the simulator has observations only, so each activation set gets a
counterpart that needs nothing else. The success of a chain is measured with these.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.skills.activation_sets import ClassifierSet, SuccessNetwork

TOLERANCE = 0.02
"""Largest error of an observed distance, as a fraction of the radius."""


class ObservedSet(Protocol):
    """A set of observations."""

    def contains(self, observations: Array) -> BoolArray:
        """Return which of the observations [B, O] lie in the set [B]."""
        ...


@dataclass(frozen=True, eq=False)
class ObservedBall:
    """The observations o with sqrt(sum_k w_k (o_k - center_k)^2) <= radius.

    Attributes:
        center: The observation in the middle [O].
        weights: w [O], at least 0: see `observed_metric`.
        radius: In the distance of the states.
    """

    center: Array
    weights: Array
    radius: float

    def contains(self, observations: Array) -> BoolArray:
        """Return which of the observations [B, O] lie in the ball [B]."""
        return _Balls([self]).contain(observations)[:, 0]


class _Balls:
    """N balls, asked at once."""

    def __init__(self, balls: Sequence[ObservedBall]):
        self._centers = np.array([ball.center for ball in balls])
        self._weights = np.array([ball.weights for ball in balls])
        self._squares = np.array([ball.radius for ball in balls]) ** 2

    def contain(self, observations: Array) -> BoolArray:
        """Return which of the observations [B, O] lie in which balls [B, N]."""
        squares = (observations[:, None] - self._centers) ** 2
        inside: BoolArray = np.einsum("bno,no->bn", squares, self._weights) <= self._squares
        return inside


@dataclass(frozen=True, eq=False)
class ObservedClassifier(SuccessNetwork):
    """The observations that a network accepts."""

    @classmethod
    def of(cls, learnt: ClassifierSet) -> "ObservedClassifier":
        """Return the network of a learnt activation set."""
        return cls(**{field.name: getattr(learnt, field.name) for field in fields(cls)})

    def contains(self, observations: Array) -> BoolArray:
        """Return which of the observations [B, O] lie in the set [B]."""
        return self.accepts(observations)


@dataclass(frozen=True, eq=False)
class Entry:
    """Where a controller hands over to a skill: in all of some sets; everywhere, where there are none."""

    parts: tuple[ObservedBall | ObservedClassifier, ...] = ()

    def contains(self, observations: Array) -> BoolArray:
        """Return which of the observations [B, O] lie in all sets [B]."""
        inside = np.ones(len(observations), dtype=np.bool_)
        for part in self.parts:
            inside &= part.contains(observations)
        return inside


class Entries:
    """The entries of S skills; each is asked as `Entry.contains` asks it, and all balls are asked at once."""

    def __init__(self, entries: Sequence[Entry]):
        self._count = len(entries)
        owned = [(index, part) for index, entry in enumerate(entries) for part in entry.parts]
        owners = [index for index, part in owned if isinstance(part, ObservedBall)]
        self._balls = _Balls([part for _, part in owned if isinstance(part, ObservedBall)])
        self._owners, self._firsts = np.unique(np.array(owners, dtype=np.int64), return_index=True)
        self._others = [(index, part) for index, part in owned if not isinstance(part, ObservedBall)]

    def last(self, observations: Array) -> IndexArray:
        """Return the last entry that each of the observations [B, O] lies in [B]; 0 where it is in none."""
        inside = np.ones((len(observations), self._count), dtype=np.bool_)
        if len(self._owners):
            inside[:, self._owners] = np.logical_and.reduceat(self._balls.contain(observations), self._firsts, axis=1)
        for index, part in self._others:
            candidates = np.flatnonzero(inside[:, index])
            inside[candidates, index] = part.contains(observations[candidates])
        inside[:, 0] = True
        last: IndexArray = self._count - 1 - inside[:, ::-1].argmax(axis=1)
        return last


def observed_metric(model: ResettableModel, states: Array, radius: float) -> Array | None:
    """Return weights w [O] with d(s, s')^2 = sum_k w_k (o_k(s) - o_k(s'))^2 for the distance d of states.

    They are fitted, not below 0, to half of the pairs of states, and have to hold for the other half to a fraction of
    `radius`. They exist where the position, say, is an entry of the observation, whatever its place and unit.

    Args:
        model: It knows distances and observations.
        states: States [N, D] all around the plan.
        radius: The largest distance that matters.

    Returns:
        The weights; None where there are none, because the observation leaves out what the distance is made of, or
        shows it in another way.
    """
    observations = model.observe(states)
    first, second = np.triu_indices(len(states), 1)
    squares = (observations[first] - observations[second]) ** 2
    from scipy.optimize import nnls  # takes longer to load than a short training

    distances = model.distance(states[first], states[second])
    fitted = np.arange(len(first)) % 2 == 0
    unit = np.maximum(squares.max(axis=0), 1e-12)  # of each entry, for the fit
    weights = nnls(squares[fitted] / unit, distances[fitted] ** 2)[0] / unit
    near = distances <= 4.0 * radius
    error = np.abs(np.sqrt(squares[near] @ weights) - distances[near])
    exact: bool = bool(near.any() and (error <= TOLERANCE * radius).all())
    return weights if exact else None


def observed_ball(model: ResettableModel, center: Array, radius: float, weights: Array) -> ObservedBall:
    """Return the ball around the observation of a state [D]."""
    return ObservedBall(model.observe(center[None])[0], weights, radius)


KINDS: dict[str, type[Any]] = {"ball": ObservedBall, "classifier": ObservedClassifier}
"""What a file may hold, by the name it has there."""


def entry_kinds(entry: Entry) -> list[str]:
    """Return the names of the kinds of its parts."""
    return [next(name for name, kind in KINDS.items() if type(part) is kind) for part in entry.parts]


def entry_to_arrays(entry: Entry, name: str) -> dict[str, np.ndarray]:
    """Return the parts of an entry as arrays called "<name>.<part>.<attribute>"."""
    return {f"{name}.{index}.{field.name}": np.asarray(getattr(part, field.name))
            for index, part in enumerate(entry.parts) for field in fields(part)}


def entry_from_arrays(kinds: list[str], arrays: Mapping[str, np.ndarray], name: str) -> Entry:
    """Return the entry of `entry_to_arrays`.

    Args:
        kinds: Those of its parts, as `entry_kinds` returns them.
        arrays: Those of `entry_to_arrays`, perhaps among others.
        name: The one that was given to `entry_to_arrays`.

    Raises:
        DamagedFile: an array is missing, or there is no such kind.
    """
    parts = []
    for index, kind in enumerate(kinds):
        try:
            values = {field.name: arrays[f"{name}.{index}.{field.name}"] for field in fields(KINDS[kind])}
        except KeyError as error:
            raise DamagedFile(f"{name}, a set of the kind {kind!r}, lacks {error}") from error
        parts.append(KINDS[kind](**{key: value if value.ndim else float(value) for key, value in values.items()}))
    return Entry(tuple(parts))
