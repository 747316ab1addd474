"""What every way of turning a plan into skills has in common."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.learner import Learner


@dataclass(frozen=True)
class Snapshot:
    """Everything a method needs to go on: plain values, and arrays by name."""

    plain: dict[str, Any]
    arrays: dict[str, np.ndarray]


class Method(Protocol):
    """A training method: small steps until it is done, each of which can be the last before a stop.

    Attributes:
        learner: Who trains, and counts what it costs.
    """

    learner: Learner

    @property
    def done(self) -> bool:
        """Whether the skills lead from the start state to the target."""
        ...

    def step(self) -> None:
        """Do one session or one test."""
        ...

    @property
    def skills(self) -> list[Skill]:
        """The skills so far, in the order of execution; the last one leads to the environment's target."""
        ...

    @property
    def covered(self) -> float:
        """Share of the plan that the skills so far cover, in [0, 1]."""
        ...

    def snapshot(self) -> Snapshot: ...
    def restore(self, snapshot: Snapshot) -> None: ...
