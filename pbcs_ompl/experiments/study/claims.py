"""What a study claims, and whether its data agree."""

from dataclasses import asdict, dataclass, field
from typing import Any

from pbcs_ompl.core.statistics import wilson


@dataclass(frozen=True)
class Claim:
    """A sentence that is true or false of the data.

    Attributes:
        claim: The sentence, with the condition that was checked.
        agrees: Whether the data agree; None when there are none that could tell.
        numbers: The numbers that decide, with their N; see `rate`.
        source: Where the claim comes from.
        note: A look at why, where there is something to say.
    """

    claim: str
    agrees: bool | None
    numbers: dict[str, Any] = field(default_factory=dict)
    source: str = ""
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self) | {"agrees": None if self.agrees is None else bool(self.agrees)}


def rate(successes: int, trials: int) -> dict[str, Any]:
    """Return {"successes", "n", "rate", "wilson"}: a rate, None without trials, and its 95 % Wilson interval."""
    successes, trials = int(successes), int(trials)
    return {"successes": successes, "n": trials, "rate": successes / trials if trials else None,
            "wilson": list(wilson(successes, trials))}
