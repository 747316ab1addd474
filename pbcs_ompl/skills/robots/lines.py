"""Many lines side by side: each execution of a batch follows one of them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.skills.path_following.line import Line, whole_periods

SHORTEST = 0.2
"""Length of the shortest random line, in those of the longest (ours)."""


def long_lines(drawn: Iterable[Line], count: int, longest: float) -> list[Line]:
    """Return the first lines of some that are long enough, cut at the longest length; no more are drawn than needed.

    Args:
        drawn: Random lines.
        count: How many to return; fewer where fewer are long enough.
        longest: Where a line ends at the latest, a length.
    """
    found: list[Line] = []
    for line in drawn:
        if line.length > SHORTEST * longest:
            found.append(replace(line, points=line.points[:int(longest / line.spacing) + 1]))
        if len(found) == count:
            break
    return found


@dataclass(frozen=True, eq=False)
class Lines:
    """A batch of lines, with the methods of `Line`, each row for a line of its own.

    Attributes:
        points: [L, P, F]; the last point of a shorter line is repeated.
        lasts: The pointers of the ends [L].
        spacings: Lengths between neighbouring points [L].
        rows: The line of each execution [B].
        periods: Of the dimensions [F]; None where none has one. See `Line.periods`.
    """

    points: Array
    lasts: IndexArray
    spacings: Array
    rows: IndexArray
    periods: Array | None = None

    @classmethod
    def of(cls, lines: Sequence[Line]) -> Self:
        """Return lines with one execution on each."""
        longest = max(len(line.points) for line in lines)
        points = np.stack([np.pad(line.points, ((0, longest - len(line.points)), (0, 0)), mode="edge")
                           for line in lines])
        return cls(points, np.array([line.last for line in lines]), np.array([line.spacing for line in lines]),
                   np.arange(len(lines)), lines[0].periods)

    def __getitem__(self, rows: IndexArray) -> "Lines":
        """Return the same lines with executions on some of them, by their indices [B]."""
        return Lines(self.points, self.lasts, self.spacings, rows, self.periods)

    @property
    def last(self) -> IndexArray:
        """The pointers of the ends [B]."""
        return self.lasts[self.rows]

    @property
    def spacing(self) -> Array:
        """Lengths between neighbouring points [B]."""
        return self.spacings[self.rows]

    def at(self, pointers: IndexArray) -> Array:
        """Return the points [B, F] of pointers [B]."""
        points: Array = self.points[self.rows, pointers]
        return points

    def unwound(self, features: Array, pointers: IndexArray) -> Array:
        """Return features [B, F] moved by whole periods; see `Line.unwound`."""
        if self.periods is None:
            return features
        return features - whole_periods(features - self.at(pointers), self.periods)

    def away(self, features: Array, pointers: IndexArray) -> Array:
        """Return the distances [B] of executions at features [B, F] from the points of pointers [B]."""
        distances: Array = np.linalg.norm(self.unwound(features, pointers) - self.at(pointers), axis=1)
        return distances

    def advance(self, features: Array, pointers: IndexArray, window: float) -> IndexArray:
        """Return the pointers [B] moved forward; see `Line.advance`.

        Args:
            features: Where the executions are [B, F].
            pointers: Where their pointers were [B].
            window: The longest move of a pointer, a length.
        """
        reach = np.maximum(1, np.rint(window / self.spacing)).astype(np.int64)
        candidates = pointers[:, None] + np.minimum(np.arange(reach.max(initial=1) + 1), reach[:, None])
        candidates = np.minimum(candidates, self.last[:, None])
        near = self.unwound(features, pointers)[:, None]
        squares = ((self.points[self.rows[:, None], candidates] - near) ** 2).sum(axis=2)
        return np.take_along_axis(candidates, squares.argmin(axis=1)[:, None], axis=1)[:, 0]

    def ahead(self, features: Array, pointers: IndexArray, distances: Array) -> Array:
        """Return points ahead of pointers, relative to the executions [B, K, F]; see `Line.ahead`.

        Args:
            features: Where the executions are [B, F].
            pointers: [B].
            distances: How far ahead, lengths [K].
        """
        steps = np.rint(np.asarray(distances) / self.spacing[:, None]).astype(np.int64)
        places = np.minimum(pointers[:, None] + steps, self.last[:, None])
        ahead: Array = self.points[self.rows[:, None], places] - self.unwound(features, pointers)[:, None]
        return ahead
