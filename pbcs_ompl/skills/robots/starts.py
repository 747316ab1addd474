"""Where the episodes of a robot's follower begin: standing, stumbling, in own good states, and where it stalled."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.skills.robots.settings import RobotStartSettings
from pbcs_ompl.skills.robots.worlds import Worlds

ADVANCED, STALLED = 8000, 3000
"""Sizes of the two pools (ours)."""
FEW = 100
"""A smaller pool is not drawn from."""
AT_THE_BEGINNING = 0.5
"""Fraction of the standing robots that begin at the beginning of a line (ours)."""
SCATTER = 0.25
"""Largest distance from the line at which one begins, in clearances along each axis (ours)."""


class Starts(NamedTuple):
    """Where executions begin: the line [B], states [B, D] and pointers [B]."""

    rows: IndexArray
    states: Array
    pointers: IndexArray


@dataclass(eq=False)
class Pool:
    """The latest starts of one kind.

    Attributes:
        rows, states, pointers: See `Starts`, [capacity, ...].
        added: How many were ever added.
    """

    rows: IndexArray
    states: Array
    pointers: IndexArray
    added: int = 0

    @classmethod
    def empty(cls, capacity: int, state_size: int) -> "Pool":
        """Return a pool without starts."""
        return cls(np.zeros(capacity, dtype=np.int64), np.zeros((capacity, state_size)),
                   np.zeros(capacity, dtype=np.int64))

    @property
    def size(self) -> int:
        """How many it holds."""
        return min(self.added, len(self.rows))

    def add(self, rows: IndexArray, states: Array, pointers: IndexArray) -> None:
        """Add starts in the place of the oldest ones."""
        places = (self.added + np.arange(len(rows))) % len(self.rows)
        self.rows[places], self.states[places], self.pointers[places] = rows, states, pointers
        self.added += len(rows)

    def draw(self, count: int, rng: np.random.Generator) -> Starts:
        """Return random ones."""
        chosen = rng.integers(0, self.size, count)
        return Starts(self.rows[chosen], self.states[chosen], self.pointers[chosen])


class StartDrawer:
    """Draws starts.

    Args:
        worlds: The lines.
        settings: Fractions.
        standing, stumbling: Bodies; see `bodies`.
        clearance: Of the lines.
    """

    def __init__(self, worlds: Worlds, settings: RobotStartSettings, standing: Array, stumbling: Array,
                 clearance: float):
        self.worlds, self.settings, self.clearance = worlds, settings, clearance
        self.standing, self.stumbling = standing, stumbling
        self.advanced = Pool.empty(ADVANCED, standing.shape[1])
        self.stalled = Pool.empty(STALLED, standing.shape[1])

    def draw(self, count: int, rng: np.random.Generator) -> Starts:
        """Return starts for training."""
        settings, kinds = self.settings, rng.random(count)
        standing = kinds < settings.standing
        rows = rng.integers(0, self.worlds.num_training, count)
        pointers = np.array([rng.choice(self.worlds.wide[row]) for row in rows.tolist()], dtype=np.int64)
        pointers[standing & (rng.random(count) < AT_THE_BEGINNING)] = 0
        states = np.where(standing[:, None], self.standing[rng.integers(0, len(self.standing), count)],
                          self.stumbling[rng.integers(0, len(self.stumbling), count)])
        states = self._put(states, rows, pointers, rng)
        first = settings.standing
        for pool, share in ((self.advanced, settings.advanced), (self.stalled, settings.stalled)):
            mine = (first <= kinds) & (kinds < first + share)
            first += share
            if pool.size >= FEW:
                rows[mine], states[mine], pointers[mine] = pool.draw(int(mine.sum()), rng)
        return Starts(rows, states, pointers)

    def tests(self, rng: np.random.Generator) -> Starts:
        """Return the starts of a test: standing at the beginning of each test line."""
        rows = np.arange(self.worlds.num_training, len(self.worlds.world_of))
        pointers = np.zeros(len(rows), dtype=np.int64)
        states = self.standing[rng.integers(0, len(self.standing), len(rows))]
        return Starts(rows, self._put(states, rows, pointers, rng), pointers)

    def _put(self, states: Array, rows: IndexArray, pointers: IndexArray, rng: np.random.Generator) -> Array:
        scatter = SCATTER * self.clearance
        points, robot = self.worlds.lines[rows].at(pointers), self.worlds.robot
        places = points[:, :2] + rng.uniform(-scatter, scatter, (len(rows), 2))
        if robot.turning == 0.0:
            return robot.put(states, places, rng.uniform(-np.pi, np.pi, len(rows)))
        before = robot.heading(self.worlds.models[0].observe(states))
        angles = points[:, 2] / robot.turning - before + rng.uniform(-scatter, scatter, len(rows)) / robot.turning
        return robot.put(states, places, angles)
