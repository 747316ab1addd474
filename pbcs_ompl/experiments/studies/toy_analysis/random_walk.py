"""When does a random walk on 1D-Toy find the reward? Exact densities by dynamic programming, and a simulation.

Lengths are in units of the largest step, 0.1: the walk begins at 0, a step is uniform on [-1, 1], and what falls below
0 has found the reward and is gone.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array

Polynomial = list[Fraction]
"""Coefficients, lowest first, in the place u in [0, 1) within a piece."""
HALF = Fraction(1, 2)


@dataclass(frozen=True)
class Density:
    """Where the walk is after n steps, when it has not found the reward before.

    Attributes:
        pieces: The density times the probability of getting so far, on [k - 1, k) for k = 0, 1, ...; the first piece
            is what finds the reward with this very step.
    """

    pieces: tuple[Polynomial, ...]

    @property
    def found(self) -> Fraction:
        """The probability that the reward is found with this step."""
        return _integral(self.pieces[0])

    @property
    def left(self) -> Fraction:
        """The probability that the reward is found later or never."""
        return sum((_integral(piece) for piece in self.pieces[1:]), Fraction(0))

    def __call__(self, positions: Array) -> Array:
        """Return the density at positions [B], under the condition that the reward was not found before."""
        table = np.zeros((len(self.pieces), max(len(piece) for piece in self.pieces)))
        for row, piece in zip(table, self.pieces, strict=True):
            row[:len(piece)] = [float(coefficient) for coefficient in piece]
        index = np.floor(positions).astype(np.int64) + 1
        inside = (index >= 0) & (index < len(self.pieces))
        index = np.where(inside, index, 0)
        place = (positions - np.floor(positions))[:, None] ** np.arange(table.shape[1])
        return np.where(inside, (table[index] * place).sum(axis=1), 0.0) / float(self.found + self.left)


def densities(steps: int, share: Fraction | int = 1) -> Iterator[Density]:
    """Yield the densities after 1, 2, ..., `steps` steps; the arithmetic is exact.

    f'(z) = p / 2 integral of f over [max(0, z - 1), z + 1], plus (1 - p) f(z) for z >= 0.

    Args:
        share: p, the probability of a step; else the walk stays. The first step is always made.

    Source: [Matheron2020] A.4.1 and A.4.2. Differs: pieces are polynomials of the place within them; densities keep
    their probability mass, which spares the normalisation; with p < 1 each density follows from the one before, where
    the formula of Theorem 5 mixes those of the walk without pauses, which is another walk.
    """
    share = Fraction(share)
    if steps < 1 or not 0 <= share <= 1:
        raise InvalidOption(f"steps={steps}, share={share}: expected at least 1, and a probability")
    density = Density(([HALF], [HALF]))
    yield density
    for _ in range(steps - 1):
        density = _after_one_step(density, share)
        yield density


def found_by(steps: int, share: Fraction | int = 1) -> Array:
    """Return the probabilities that the reward is found within 1, 2, ..., `steps` steps [steps]; Figs. A.2, A.3."""
    total, result = Fraction(0), []
    for density in densities(steps, share):
        total += density.found
        result.append(float(total))
    return np.array(result)


def simulate(walks: int, steps: int, share: float = 1.0, *, seed: int = 0) -> tuple[Array, Array]:
    """Return the shares of walks that found the reward within 1, ..., `steps` steps [steps], and the last positions.

    The positions are those after the last step of the walks that had not found the reward before it.
    """
    rng = np.random.default_rng(seed)
    positions, found = np.zeros(walks), np.empty(steps)
    for step in range(steps):
        positions = positions[positions >= 0.0]
        moves = rng.uniform(-1.0, 1.0, len(positions))
        if step > 0 and share < 1.0:
            moves[rng.random(len(moves)) >= share] = 0.0
        positions = positions + moves
        found[step] = 1.0 - (positions >= 0.0).sum() / walks
    return found, positions


def _after_one_step(density: Density, share: Fraction) -> Density:
    alive: list[Polynomial] = [[], *density.pieces[1:], [], []]
    pieces = []
    for k in range(len(density.pieces) + 1):
        before = alive[k - 1] if k > 0 else []
        upper, full = _antiderivative(before), _integral(alive[k])
        # The integral over [z - 1, z + 1]: the rest of the piece before, this piece, the beginning of the next.
        moved = _add([_integral(before) + full], _scaled(upper, Fraction(-1)), _antiderivative(alive[k + 1]))
        pieces.append(_add(_scaled(moved, share * HALF), _scaled(alive[k], 1 - share)))
    return Density(tuple(pieces))


def _antiderivative(piece: Polynomial) -> Polynomial:
    return [Fraction(0), *(coefficient / (power + 1) for power, coefficient in enumerate(piece))]


def _integral(piece: Polynomial) -> Fraction:
    return sum((coefficient / (power + 1) for power, coefficient in enumerate(piece)), Fraction(0))


def _scaled(piece: Polynomial, factor: Fraction) -> Polynomial:
    return [factor * coefficient for coefficient in piece]


def _add(*pieces: Polynomial) -> Polynomial:
    total = [Fraction(0)] * max(len(piece) for piece in pieces)
    for piece in pieces:
        for power, coefficient in enumerate(piece):
            total[power] += coefficient
    return total
