"""A path that is made step by step, taken back, and put in place of a part of another."""

from dataclasses import dataclass, field

from pbcs_ompl.bridge.improvement.free_space import ShortCut
from pbcs_ompl.core.types import Array, Transition


@dataclass
class GrowingPath:
    """States [T+1, D], controls [T, A] and rewards [T], as lists that grow at their end."""

    states: list[Array]
    controls: list[Array] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.controls)

    def first(self, steps: int) -> "GrowingPath":
        """Return a copy of the first steps."""
        return GrowingPath(self.states[:steps + 1], self.controls[:steps], self.rewards[:steps])

    def append(self, outcome: Transition, controls: Array, row: int) -> None:
        """Go on by one transition of a batch."""
        self.states.append(outcome.states[row])
        self.controls.append(controls[row])
        self.rewards.append(float(outcome.rewards[row]))

    def spliced(self, cut: ShortCut, path: "GrowingPath") -> "GrowingPath":
        """Return a copy with a path in place of the steps from cut.first to cut.last."""
        return GrowingPath(self.states[:cut.first] + path.states + self.states[cut.last + 1:],
                           self.controls[:cut.first] + path.controls + self.controls[cut.last:],
                           self.rewards[:cut.first] + path.rewards + self.rewards[cut.last:])

    def cut_to(self, steps: int) -> None:
        """Keep the first steps."""
        del self.states[steps + 1:], self.controls[steps:], self.rewards[steps:]
