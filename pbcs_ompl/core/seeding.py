"""One seed tree per run: every random stream is derived from the run's seed and a name."""

import zlib

import numpy as np

from pbcs_ompl.core.options import check_range


class SeedTree:
    """A seed from which named, independent streams are derived.

    The same seed and the same names give the same streams in every process, whatever the order of the calls.

    Example:
        >>> SeedTree(1).child("planner").integer() == SeedTree(1).child("planner").integer()
        True
    """

    def __init__(self, seed: int, *path: int):
        check_range("seed", seed, seed >= 0, "a whole number of at least 0")
        self._sequence = np.random.SeedSequence(entropy=seed, spawn_key=path)
        self.seed = seed
        self._path = path

    def child(self, name: str | int) -> "SeedTree":
        """Return the subtree of one name."""
        key = name if isinstance(name, int) else zlib.crc32(name.encode())
        return SeedTree(self.seed, *self._path, key)

    def integer(self) -> int:
        """Return this node's seed as an integer in [1, 2**31 - 1], for libraries that want one."""
        return int(self._sequence.generate_state(1)[0]) % (2**31 - 1) + 1

    def integer64(self) -> int:
        """Return this node's seed as an integer in [0, 2**64 - 1], for streams of which there are many."""
        return int(self._sequence.generate_state(1, np.uint64)[0])

    def generator(self) -> np.random.Generator:
        """Return a NumPy generator of this node's stream."""
        return np.random.Generator(np.random.PCG64(self._sequence))
