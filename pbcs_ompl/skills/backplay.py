"""Backplay: train one skill by moving its start backwards along a plan; [Matheron2020] Alg. 7."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.learner import Learner
from pbcs_ompl.skills.policy import SkillPolicy

WORTH_A_TEST = 0.95
"""Sessions explore, and an episode may fail by its random actions alone: from here on a test decides."""


@dataclass
class BackplayState:
    """Where Backplay's loop stands.

    Attributes:
        start: K, the milestone where episodes start now.
        stride: Milestones between this start point and the next.
        saved: K_s, the start of the best skill so far; -1 when there is none.
        phase: What the next step does.
        best, misses: Highest success rate of a session here, and the sessions since then without a higher one.
        sessions: Training sessions of this skill so far.
        anew: Whether it has been begun anew with fresh networks, having no start point yet.
    """

    start: int
    stride: int
    saved: int = -1
    phase: Literal["pretest", "train", "probe", "test"] = "pretest"
    best: float = -1.0
    misses: int = 0
    sessions: int = 0
    anew: bool = False


class Backplay:
    """One skill that ends at the learner's goal, learnt in small steps that can be interrupted.

    Args:
        learner: It aims at the end of the skill already.
        floor: The milestone at which the skill is long enough.

    Source: [Matheron2020] Alg. 7. Differs: index 0 is trained too; once a session succeeds, a test may end the
    training loop before alpha sessions without improvement (`stop_at_success`); the stride between start points
    doubles while tests pass and halves when they fail (`min_stride = max_stride = 1` is the thesis); a start point
    that stays partly solved ends the skill unless `keep_partial`; a skill that has no start point yet begins anew with
    fresh networks, and if this does not help passes over such start points, as Alg. 7 does. A ball can hold states from
    which there is no short way to a goal nearby, such as those of a car that has passed it and is too slow to return.
    """

    def __init__(self, learner: Learner, floor: int = 0):
        self.learner = learner
        self.floor = floor
        self.settings = learner.settings
        self.state = BackplayState(self._first_start(), self.settings.min_stride)
        self.saved_policy: SkillPolicy | None = None
        self.done = False

    @property
    def skill(self) -> Skill | None:
        """The best skill so far."""
        if self.saved_policy is None:
            return None
        return self.learner.skill(self.state.saved, self.saved_policy)

    def step(self) -> None:
        """Do one session or one test."""
        if self.state.phase == "train":
            self._train()
        else:
            self._test()

    def _train(self) -> None:
        state, success = self.state, self.learner.session(self.state.start)
        state.sessions += 1
        if success > state.best:
            state.best, state.misses = success, 0
        else:
            state.misses += 1
        if state.misses >= self.settings.alpha:
            state.phase = "test"
        elif self.settings.stop_at_success and success >= WORTH_A_TEST:
            state.phase = "probe"

    def _test(self) -> None:
        state, success = self.state, self.learner.test(self.state.start)
        if success == 1.0:
            self._save()
            self._move_on()
        elif state.phase == "pretest" and success == 0.0 and self._can_come_closer():
            state.stride = max(self.settings.min_stride, (state.saved - state.start) // 2)
            state.start = state.saved - state.stride
        elif state.phase == "pretest":
            self._train_from_here()
        elif state.phase == "probe":
            state.phase = "train"
        else:
            self._give_up(success)

    def _give_up(self, success: float) -> None:
        """Training here has stabilised below 100 %."""
        state, begun = self.state, self.saved_policy is not None
        if begun and (success == 0.0 or not self.settings.keep_partial):
            self.done = True
        elif success > 0.0 and (begun or state.start > self.floor) and (self.settings.keep_partial or state.anew):
            self._move_on()
        elif self.settings.keep_partial:
            self._train_from_here()
        else:
            self._begin_anew()

    def _begin_anew(self) -> None:
        """Forget everything; the first start point is tried again, and only then start points are passed over."""
        state = self.state
        state.anew = not state.anew
        self.learner.restart()
        state.start = self._first_start()
        self._train_from_here()

    def _first_start(self) -> int:
        return max(self.floor, self.learner.goal_index - self.settings.min_stride)

    def _train_from_here(self) -> None:
        state = self.state
        state.phase, state.best, state.misses = "train", -1.0, 0

    def _save(self) -> None:
        state = self.state
        if self.saved_policy is not None:
            state.stride = min(2 * state.stride, self.settings.max_stride)
        self.saved_policy, state.saved = self.learner.policy(), state.start

    def _move_on(self) -> None:
        state = self.state
        self.done = state.start == self.floor
        state.start = max(self.floor, state.start - state.stride)
        state.phase = "pretest"

    def _can_come_closer(self) -> bool:
        return self.saved_policy is not None and self.state.saved - self.state.start > self.settings.min_stride

    def to_dict(self) -> dict[str, Any]:
        """Return the loop's variables as plain values."""
        return asdict(self.state)

    def restore(self, values: dict[str, Any], policy: SkillPolicy | None) -> None:
        """Go on from `to_dict()` and the saved policy."""
        self.state = BackplayState(**values)
        self.saved_policy = policy
