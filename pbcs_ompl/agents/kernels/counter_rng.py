"""Random numbers as a function of a key and a position: independent streams that need no state."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.seeding import SeedTree

Keys = NDArray[np.uint64]
Numbers = NDArray[np.float32]


def stream_keys(seeds: Sequence[int], name: str) -> Keys:
    """Return one key of 64 bits [S] for each seed and this name."""
    return np.array([SeedTree(seed).child(name).integer64() for seed in seeds], dtype=np.uint64)


def uniform(keys: Keys, first: int, count: int, shape: tuple[int, ...]) -> Numbers:
    """Return numbers in [0, 1) [count, S, *shape]: draws number first, first + 1, ... of every stream."""
    out = np.empty((count, len(keys), int(np.prod(shape))), dtype=np.float32)
    _uniform(keys, first, out)
    return out.reshape(count, len(keys), *shape)


def normal(keys: Keys, first: int, count: int, shape: tuple[int, ...]) -> Numbers:
    """Return normally distributed numbers [count, S, *shape]; see `uniform`."""
    out = np.empty((count, len(keys), int(np.prod(shape))), dtype=np.float32)
    _normal(keys, first, out)
    return out.reshape(count, len(keys), *shape)


@njit()
def hashed(key: np.uint64, position: int) -> float:
    """Return a number in [0, 1) with 53 random bits: splitmix64 of key and position."""
    z = key * np.uint64(0xD1342543DE82EF95) + np.uint64(position) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * 2.0**-53


@njit()
def _uniform(keys: Keys, first: int, out: Numbers) -> None:
    count, seeds, width = out.shape
    for k in range(count):
        for s in range(seeds):
            for i in range(width):
                # Rounding to float32 must not reach 1.
                out[k, s, i] = min(np.float32(hashed(keys[s], (first + k) * width + i)), np.float32(1.0 - 2.0**-24))


@njit()
def _normal(keys: Keys, first: int, out: Numbers) -> None:
    count, seeds, width = out.shape
    for k in range(count):
        for s in range(seeds):
            for i in range(width):
                place = 2 * ((first + k) * width + i)
                radius = np.sqrt(-2.0 * np.log(1.0 - hashed(keys[s], place)))
                out[k, s, i] = np.float32(radius * np.cos(2.0 * np.pi * hashed(keys[s], place + 1)))
