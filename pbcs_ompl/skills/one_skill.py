"""The methods of chapter 5: one skill from the start to the target, and what moves its start."""

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.learner import Learner
from pbcs_ompl.skills.method import Snapshot


@dataclass
class OneSkillState:
    """Where the loop of a one-skill method stands.

    Attributes:
        start: The milestone where episodes start now.
        sessions: Sessions at this place so far.
        tested: Whether this start point has been tested since the last change.
        solved: Whether the policy has passed its last test, from milestone 0.
        filled: Whether the replay buffer has been filled beforehand, by methods that do so.
    """

    start: int
    sessions: int = 0
    tested: bool = False
    solved: bool = False
    filled: bool = False


class OneSkill(ABC):
    """A single policy that is trained to reach the environment's target from ever earlier milestones."""

    def __init__(self, learner: Learner):
        self.learner = learner
        self.settings = learner.settings
        self.state = OneSkillState(self._first_start())

    @abstractmethod
    def _first_start(self) -> int:
        """Return the milestone where training begins."""

    @abstractmethod
    def step(self) -> None:
        """Do one session or one test."""

    @property
    def done(self) -> bool:
        """Whether the policy reaches the target from the start."""
        return self.state.solved

    @property
    def skills(self) -> list[Skill]:
        """The policy as a chain of one skill."""
        return [self.learner.skill(0, self.learner.policy())]

    @property
    def covered(self) -> float:
        """Share of the plan that lies behind the present start point."""
        return 1.0 if self.done else 1.0 - self.state.start / self.learner.milestones.last

    def snapshot(self) -> Snapshot:
        """Return everything needed to go on bit for bit."""
        plain, arrays = self.learner.state()
        return Snapshot({"learner": plain, "state": asdict(self.state)}, arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from what `snapshot` returned."""
        self.learner.restore(snapshot.plain["learner"], snapshot.arrays)
        values: dict[str, Any] = snapshot.plain["state"]
        self.state = OneSkillState(**values)


class PB(OneSkill):
    """Plan, Backplay: the start moves back as soon as every test episode succeeds.

    Source: [Matheron2020] section 5.3, Fig. 5.1(a), and with `pretest` Fig. 5.1(b). Differs: with `rehearsal`, some
    training episodes start from milestones already passed; strides as in Backplay.
    """

    def _first_start(self) -> int:
        return max(0, self.learner.milestones.last - self.settings.min_stride)

    def step(self) -> None:
        """Test the start point (before training too, with `pretest`), or train there for a session."""
        state = self.state
        if state.tested or (state.sessions == 0 and not self.settings.pretest):
            self.learner.session(state.start)
            state.sessions += 1
            state.tested = False
        elif self.learner.test(state.start) == 1.0:
            state.solved = state.start == 0
            state.start = max(0, state.start - self.settings.min_stride)
            state.sessions = 0
        else:
            state.tested = True


class SlidingWindow(OneSkill):
    """The original Backplay: start points are drawn from a window that slides back on a schedule.

    Source: Resnick et al. 2018, as in [Matheron2020] section 5.2. Differs: once the window has reached the start, the
    policy is tested there after every session and training goes on until it passes.
    """

    def _first_start(self) -> int:
        return max(0, self.learner.milestones.last - self._width())

    def _width(self) -> int:
        return max(1, round(self.settings.window * self.learner.milestones.last))

    def step(self) -> None:
        """Train for a session in the window; move it when its time is over; test at the start."""
        state, width = self.state, self._width()
        if state.tested:
            state.tested = False
            state.solved = self.learner.test(0) == 1.0
            return
        end = min(state.start + width, self.learner.milestones.last)
        self.learner.session_from(self.learner.rng.integers(state.start, end, self.settings.beta))
        state.sessions += 1
        if state.start == 0:
            state.tested = True
        elif state.sessions >= self.settings.window_sessions:
            state.start, state.sessions = max(0, state.start - width), 0


class Plain(OneSkill):
    """The agent alone: every episode starts at the environment's start, nothing of the plan is used."""

    def _first_start(self) -> int:
        return 0

    @property
    def covered(self) -> float:
        """All or nothing."""
        return float(self.done)

    def step(self) -> None:
        """Train for a session from the start, then test there."""
        state = self.state
        if state.tested:
            state.tested = False
            state.solved = self.learner.test(0) == 1.0
        else:
            self.learner.session_from(np.zeros(self.settings.beta, dtype=np.int64))
            state.tested = True
