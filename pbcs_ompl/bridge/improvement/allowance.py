"""What making a plan shorter may use, and what it has brought."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Any, NamedTuple, Self

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Solution


class Allowance(NamedTuple):
    """What improving a plan may use: one of a number of transitions, a share of those of the search, wall time."""

    transitions: int | None = None
    share: float | None = None
    seconds: float | None = None

    @classmethod
    def of(cls, amount: int | str) -> Self:
        """Return what an amount stands for: 5000 transitions, "10%" of those of the search, "2s" of wall time.

        Raises:
            InvalidOption: it is none of these, or below 0.
        """
        text = str(amount).strip()
        number = text.removesuffix("%").removesuffix("s")
        kind = text[len(number):]
        try:
            value = float(number)
        except ValueError:
            value = nan
        if not (isfinite(value) and value >= 0) or kind == "%s" or (kind == "" and value != int(value)):
            raise InvalidOption(f"improve is {amount!r}; expected a number of transitions as 5000, a share of those of "
                                f"the search as '10%', or seconds as '2s'")
        if kind == "":
            return cls(transitions=int(value))
        return cls(share=value / 100.0) if kind == "%" else cls(seconds=value)

    @property
    def nothing(self) -> bool:
        """Whether nothing may be used."""
        return not (self.transitions or self.share or self.seconds)

    def after(self, transitions: int) -> Self:
        """Return the allowance after a search with a number of transitions: a share of them becomes a number."""
        return self if self.share is None else type(self)(transitions=int(self.share * transitions))


@dataclass(frozen=True)
class Improvement:
    """What improving a plan has brought.

    Attributes:
        before, after: Steps of the plan.
        transitions: Environment steps that were made for it, beside those of the search until its first solution.
        seconds: Wall time.
        progress: After how many of these transitions and seconds the plan had which length, first that of the search.
    """

    before: int
    after: int
    transitions: int
    seconds: float
    progress: dict[str, list[Any]] = field(default_factory=dict)

    @classmethod
    def of_search(cls, solutions: Sequence[Solution], transitions: int, seconds: float) -> Self:
        """Return what a search has brought that continued after its first solution.

        Args:
            solutions: The solutions, each of fewer steps than the one before.
            transitions, seconds: Those of the whole search.
        """
        first, last = solutions[0], solutions[-1]
        progress: dict[str, list[Any]] = {
            "transitions": [one.transitions - first.transitions for one in solutions],
            "seconds": [one.seconds - first.seconds for one in solutions],
            "length": [one.steps for one in solutions]}
        return cls(first.steps, last.steps, transitions - first.transitions, seconds - first.seconds, progress)
