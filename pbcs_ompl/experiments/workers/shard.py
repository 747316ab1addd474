"""A part of the runs, for one of several processes or machines."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from pbcs_ompl.core.errors import InvalidOption

Run = TypeVar("Run")


@dataclass(frozen=True)
class Shard:
    """Every `count`-th run, from the `index`-th on. The shards 1 to `count` have each run once.

    Raises:
        InvalidOption: `index` is not among 1 to `count`.
    """

    index: int
    count: int

    def __post_init__(self) -> None:
        if not 1 <= self.index <= self.count:
            raise InvalidOption(f"shard {self} does not exist; expected i/n with i from 1 to n, such as 2/3")

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"

    def of(self, runs: Sequence[Run]) -> list[Run]:
        """Return the runs of this shard."""
        return list(runs[self.index - 1::self.count])
