"""The free space of a plane with walls, and shortest ways through it: lines that need no planner."""

from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.skills.path_following.line import Line, erase_loops
from pbcs_ompl.skills.robots.lines import SHORTEST, long_lines

CELLS = 3.0
"""Grid cells in the clearance of a line."""
COMFORT, DETOUR = 2.5, 0.3
"""A way is dearer below `COMFORT` clearances from a wall: at the wall by `DETOUR` times their number (ours)."""
WIDE = 1.8
"""Clearances from the walls at which a body has the space to begin (ours)."""
SHARPEST = 2.1
"""Largest turn between two legs of a random line, in radians (ours): a line does not lead back where it came from."""
TUBE = 1.5
"""Clearances from a plan within which its smoothed line stays, where one exists there (ours)."""
NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))


class FreeSpace:
    """A grid over a rectangle with walls; a cell is free where its centre is farther than `clearance` from them.

    Args:
        walls: [W, 4] (x0, y0, x1, y1).
        low, high: Corners of the rectangle [2].
        clearance: The least distance of lines from walls, a length.
    """

    def __init__(self, walls: Array, low: Array, high: Array, clearance: float):
        self.walls, self.low, self.clearance, self.edge = walls, low, clearance, clearance / CELLS
        columns, rows = np.maximum(1, np.floor((high - low) / self.edge)).astype(int).tolist()
        self.shape: tuple[int, int] = (columns, rows)
        centres = np.stack(np.meshgrid(*(np.arange(count) for count in self.shape), indexing="ij"), axis=2)
        self.centres = low + (centres.reshape(-1, 2) + 0.5) * self.edge
        self.distances = self.distance(self.centres)

    def distance(self, places: Array) -> Array:
        """Return the distances [B] of places [B, 2] from the nearest wall; infinity where there is none."""
        nearest = np.full(len(places), np.inf)
        for x0, y0, x1, y1 in self.walls.tolist():
            x = np.maximum(np.maximum(x0 - places[:, 0], places[:, 0] - x1), 0.0)
            y = np.maximum(np.maximum(y0 - places[:, 1], places[:, 1] - y1), 0.0)
            np.minimum(nearest, np.hypot(x, y), out=nearest)
        return nearest

    @property
    def wide(self) -> IndexArray:
        """The cells in which a body has the space to begin."""
        return np.flatnonzero(self.distances > WIDE * self.clearance)

    @cached_property
    def _graph(self) -> csr_matrix:
        """Neighbouring free cells, and what it costs to go from one to the other."""
        index = np.arange(len(self.centres)).reshape(self.shape)
        free = self.distances > self.clearance
        near = np.maximum(0.0, COMFORT - self.distances / self.clearance)
        firsts, seconds = [], []
        for right, up in NEIGHBOURS:
            first = index[:index.shape[0] - right, max(0, -up):index.shape[1] - max(0, up)].ravel()
            second = index[right:, max(0, up):index.shape[1] + min(0, up)].ravel()
            both = free[first] & free[second]
            firsts.append(first[both])
            seconds.append(second[both])
        first, second = np.concatenate(firsts), np.concatenate(seconds)
        lengths = np.linalg.norm(self.centres[first] - self.centres[second], axis=1)
        costs = lengths * (1.0 + DETOUR * (near[first] + near[second]) / 2)
        return csr_matrix((costs, (first, second)), shape=(len(self.centres), len(self.centres)))

    def cell(self, place: Array) -> int:
        """Return the free cell that is nearest to a place [2].

        Raises:
            InvalidState: no cell is free.
        """
        free: BoolArray = self.distances > self.clearance
        if not free.any():
            raise InvalidState(f"no place is farther than {self.clearance:g} from the walls; choose a smaller "
                               "clearance")
        squares = np.where(free, ((self.centres - place) ** 2).sum(axis=1), np.inf)
        return int(squares.argmin())

    def ways(self, first: int, targets: IndexArray, within: BoolArray | None = None) -> list[Array | None]:
        """Return the cheapest ways from a cell to others, corners [N, 2] each; None where there is none.

        Args:
            first: The cell where they begin.
            targets: Those where they end.
            within: Which cells they may use, beside those two [N]; None for all that are free.
        """
        graph = self._graph
        if within is not None:
            within = within.copy()
            within[[first, *targets]] = True
            kept = csr_matrix((within.astype(float), (np.arange(len(within)),) * 2), shape=graph.shape)
            graph = (kept @ graph @ kept).tocsr()
            graph.eliminate_zeros()
        _, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
        found: list[Array | None] = []
        for target in targets.tolist():
            way = [target]
            while way[-1] != first and before[way[-1]] >= 0:
                way.append(int(before[way[-1]]))
            if way[-1] != first:
                found.append(None)
                continue
            corners = self.centres[way[::-1]]
            found.append(corners[erase_loops(corners, 2.0 * self.edge)])
        return found

    def line_between(self, start: Array, goal: Array, spacing: float) -> Line:
        """Return the line of the cheapest way between two places [2].

        Args:
            start, goal: Its ends, which need no clearance.
            spacing: Of the points of the line.

        Raises:
            InvalidState: no way leads from one to the other.
        """
        (way,) = self.ways(self.cell(start), np.array([self.cell(goal)]))
        if way is None:
            raise InvalidState(f"no way from {start.tolist()} to {goal.tolist()} with {self.clearance:g} to the walls; "
                               "choose a smaller clearance")
        return Line.through(np.concatenate([start[None], way[1:-1], goal[None]]), spacing)

    def smoothed(self, places: Array, goal: Array, spacing: float) -> Line:
        """Return the line of the cheapest way from the first of some places to a goal that stays near all of them.

        It keeps clear of walls and leaves out what exploration did in between. Near is within `TUBE` clearances; where
        no way is that near, because the places are too close to walls, twice as far, and so on.

        Args:
            places: Those of a plan [T+1, 2].
            goal: Where the line ends [2].
            spacing: Of the points of the line.

        Raises:
            InvalidState: no way leads there at all.
        """
        away, _ = KDTree(np.concatenate([places, goal[None]])).query(self.centres)
        first, last, width = self.cell(places[0]), self.cell(goal), TUBE * self.clearance
        while width < away.max():
            (way,) = self.ways(first, np.array([last]), away <= width)
            if way is not None:
                return Line.through(np.concatenate([places[:1], way[1:-1], goal[None]]), spacing)
            width *= 2.0
        return self.line_between(places[0], goal, spacing)

    def random_lines(self, count: int, rng: np.random.Generator, *, longest: float, spacing: float) -> list[Line]:
        """Return lines through random places: cheapest ways from one to the next, of one to three legs each.

        Args:
            count: How many.
            rng: The random numbers.
            longest: Where a line ends at the latest, a length.
            spacing: Of the points of a line.

        Raises:
            InvalidState: there is hardly any free space.
        """
        ways = (self._random_way(rng) for _ in range(20 * count if len(self.wide) else 0))
        lines = long_lines((Line.through(way, spacing) for way in ways if way is not None), count, longest)
        if len(lines) < count:
            raise InvalidState(f"only {len(lines)} of {count} random lines of at least {SHORTEST * longest:g} were "
                               "found; choose shorter ones or a smaller clearance")
        return lines

    def _random_way(self, rng: np.random.Generator) -> Array | None:
        places = rng.choice(self.wide, int(rng.integers(2, 5)))
        legs = [self.ways(int(first), np.array([second]))[0] for first, second in pairwise(places)]
        whole = [leg for leg in legs if leg is not None and len(leg) > 1]
        if len(whole) < len(legs) or any(_turn(before, after) > SHARPEST for before, after in pairwise(whole)):
            return None
        return np.concatenate(whole)


def _turn(before: Array, after: Array) -> float:
    """Return the angle between the end of one way and the beginning of the next."""
    last, first = before[-1] - before[-2], after[1] - after[0]
    cosine = float(last @ first) / float(np.linalg.norm(last) * np.linalg.norm(first))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
