"""Lines in feature space, and pointers that move forward on them: what a follower follows."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray, IndexArray


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline whose neighbouring points are `spacing` apart along it, with pointers into its points.

    All lengths are in the unit of the points, which whoever draws the line chooses.

    Attributes:
        points: [P, F], from the start to the end; a line of no length has one.
        spacing: Length of the line between neighbouring points.
        pass_radius: A pointer passes a point only within this distance of it, or while points come nearer. So what is
            on the other side of a wall does not draw a pointer past the end of the wall.
        periods: The period of each dimension [F], 0 for none; None where none has one. Points count on after a whole
            period, as an angle that turns further and further: what is near a point is so in whatever turn.
    """

    points: Array
    spacing: float
    pass_radius: float = np.inf
    periods: Array | None = None

    @classmethod
    def through(cls, corners: Array, spacing: float, pass_radius: float = np.inf,
                periods: Array | None = None) -> "Line":
        """Return the line through some corners in order.

        Args:
            corners: [N, F]; equal ones in a row count once. The line does not take a short way round by itself: see
                `unwrapped`.
            spacing: Length between the points of the line, about: a whole number of them fits into the length.
            pass_radius, periods: See the attributes.

        Raises:
            InvalidOption: no corner, one that is not finite, or a spacing that is not greater than 0.
        """
        if corners.ndim != 2 or not len(corners) or not np.isfinite(corners).all():
            raise InvalidOption(f"corners of the shape {corners.shape}; expected finite ones [N, F], N at least 1")
        if not spacing > 0:
            raise InvalidOption(f"spacing={spacing:g}; expected greater than 0")
        lengths = arc_lengths(corners)
        if lengths[-1] == 0.0:
            return cls(corners[:1].copy(), spacing, pass_radius, periods)
        kept = np.concatenate([[True], np.diff(lengths) > 0])
        count = max(1, round(float(lengths[-1]) / spacing))
        places = np.linspace(0.0, lengths[-1], count + 1)
        columns = [np.interp(places, lengths[kept], column) for column in corners[kept].T]
        return cls(np.stack(columns, axis=1), float(lengths[-1]) / count, pass_radius, periods)

    @property
    def last(self) -> int:
        """The pointer of the end."""
        return len(self.points) - 1

    @property
    def length(self) -> float:
        """From the start to the end."""
        return self.spacing * self.last

    def unwound(self, features: Array, pointers: IndexArray) -> Array:
        """Return features [B, F] moved by whole periods to where they are nearest to the points at pointers [B]."""
        if self.periods is None:
            return features
        return features - whole_periods(features - self.points[pointers], self.periods)

    def pointer_at(self, lengths: Array) -> IndexArray:
        """Return the pointers [B] of the points nearest to some lengths [B] from the start."""
        return np.clip(np.rint(np.asarray(lengths) / self.spacing), 0, self.last).astype(np.int64)

    def advance(self, features: Array, pointers: IndexArray, window: float) -> IndexArray:
        """Return the pointers [B] moved forward: to the nearest point of those up to `window` ahead.

        A pointer never moves back. Where a line comes close to itself, the window keeps a pointer from leaving out what
        lies between, and so does `pass_radius`.

        Args:
            features: Where the executions are [B, F].
            pointers: Where their pointers were [B].
            window: The longest move, a length.
        """
        moves = np.arange(max(1, round(window / self.spacing)) + 1)
        candidates = np.minimum(pointers[:, None] + moves, self.last)
        squares = ((self.points[candidates] - self.unwound(features, pointers)[:, None]) ** 2).sum(axis=2)
        barred = (squares[:, 1:] > squares[:, :-1]) & (squares[:, 1:] > self.pass_radius ** 2)
        squares[:, 1:][np.logical_or.accumulate(barred, axis=1)] = np.inf
        return np.take_along_axis(candidates, squares.argmin(axis=1)[:, None], axis=1)[:, 0]

    def nearest(self, features: Array, pointers: IndexArray) -> IndexArray:
        """Return the pointers [B] of the nearest points of those up to `pointers` [B].

        Args:
            features: Where the executions are [B, F].
            pointers: [B].
        """
        squares = ((self.points[None] - self.unwound(features, pointers)[:, None]) ** 2).sum(axis=2)
        squares[np.arange(len(self.points)) > pointers[:, None]] = np.inf
        nearest: IndexArray = squares.argmin(axis=1)
        return nearest

    def ahead(self, features: Array, pointers: IndexArray, distances: Array) -> Array:
        """Return points of the line ahead of pointers, relative to where the executions are [B, K, F].

        A point beyond the end is the end.

        Args:
            features: Where the executions are [B, F].
            pointers: [B].
            distances: How far ahead along the line, lengths [K].
        """
        places = np.minimum(pointers[:, None] + np.rint(np.asarray(distances) / self.spacing).astype(np.int64),
                            self.last)
        return self.points[places] - self.unwound(features, pointers)[:, None]


def whole_periods(differences: Array, periods: Array) -> Array:
    """Return what to take away from differences [..., F] to make them shortest: multiples of periods [F], 0 for none.
    """
    return periods * np.rint(differences / np.where(periods > 0.0, periods, np.inf))


def unwrapped(features: Array, periods: Array) -> Array:
    """Return features [N, F] that count on after a whole period [F]: each is nearest to the one before it."""
    steps = np.diff(features, axis=0)
    return np.concatenate([features[:1], features[1:] - np.cumsum(whole_periods(steps, periods), axis=0)])


def arc_lengths(corners: Array) -> Array:
    """Return the lengths [N] from the first of some corners [N, F] to each of them."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])


def erase_loops(features: Array, gap: Array | float, periods: Array | None = None) -> IndexArray:
    """Return the indices [M] of the path with the fewest hops along `features` [T+1, F]; see `fewest_hops`.

    Args:
        features: Those of a plan [T+1, F].
        gap: Longest hop along each feature dimension, [F] or one for all.
        periods: The period of each dimension [F], 0 for none; None where none has one.
    """
    def near(index: int) -> BoolArray:
        hops = features[index + 1:] - features[index]
        if periods is not None:
            hops -= whole_periods(hops, periods)
        close: BoolArray = (np.abs(hops) <= gap).all(axis=1)
        return close

    return fewest_hops(len(features), near)


def fewest_hops(count: int, near: Callable[[int], BoolArray]) -> IndexArray:
    """Return the indices [M] of the path with the fewest hops from the first to the last of `count` items.

    A hop leads to the next item, or to any later one that is near. Exploration returns to places where it was before,
    and a hop leaves such a loop out.

    Args:
        count: Number of items, at least 1.
        near: Which of the items after an index are near it.

    Source: dynamic programming over the indices, count^2 / 2 comparisons. Not in [Matheron2020].
    """
    last = count - 1
    hops = np.full(count, np.iinfo(np.int64).max)
    before = np.arange(-1, last)
    hops[0] = 0
    for index in range(last):
        close = near(index).copy()
        close[0] = True
        better = index + 1 + np.flatnonzero(close & (hops[index + 1:] > hops[index] + 1))
        hops[better] = hops[index] + 1
        before[better] = index
    path = [last]
    while path[-1] > 0:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)
