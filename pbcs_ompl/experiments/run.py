"""One run of an experiment: what it is a function of, what it found, and why it found nothing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.options import check_range

Record = dict[str, Any]
"""What a run found: plain values, as its file holds them."""
Item = TypeVar("Item")


@dataclass(frozen=True)
class Run:
    """What one run is a function of.

    Attributes:
        name: Unlike those of all other runs of the experiment; names the file of its record.
        settings: Everything that the run depends on, as plain values.
    """

    name: str
    settings: dict[str, Any]


@dataclass(frozen=True)
class Failure:
    """Why a run has no record.

    Attributes:
        reason: One line.
    """

    reason: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "reason", " ".join(self.reason.split()))


RunFunction = Callable[[Run], Record]
"""Makes a run and returns its record. Other processes import it by its name."""


MOST_SEEDS = 100_000


def check_number_of_seeds(seeds: int) -> int:
    """Return it.

    Raises:
        InvalidOption: fewer than one, or more than one machine could ever make.
    """
    check_range("seeds", seeds, 1 <= seeds <= MOST_SEEDS, f"from 1 to {MOST_SEEDS}")
    return seeds


@dataclass(frozen=True)
class Shard:
    """Every `count`-th run, from the `index`-th on. Together the shards 1 to `count` have each run once.

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

    def of(self, runs: Sequence[Item]) -> list[Item]:
        """Return the runs of this shard."""
        return list(runs[self.index - 1::self.count])
