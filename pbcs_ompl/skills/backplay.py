"""Backplay: train one skill by moving its start backwards along a plan; [Matheron2020] Alg. 7."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

from pbcs_ompl.skills.policy import SkillPolicy
from pbcs_ompl.skills.settings import Settings
from pbcs_ompl.skills.trainer import SkillTrainer


@dataclass(frozen=True)
class SkillSettings(Settings):
    """How one skill is trained backwards.

    Attributes:
        alpha: Sessions without improvement after which training has stabilised ([Matheron2020] Alg. 7: 10).
        stop_at_success: Let a test end a training loop early, instead of waiting for alpha sessions (ours).
        test_threshold: Success rate of a session from which such a test is worth its steps: an episode with
            exploration noise may fail by that alone (ours, not tuned).
        skip_unsolved: Move on when a start point is only partly solved ([Matheron2020] Alg. 7); else the skill ends.
        min_stride, max_stride: Waypoints between start points; the stride doubles while tests pass and halves when
            they fail ([Matheron2020]: 1).
        rehearsal_fraction: Fraction of training episodes that start from a random waypoint passed before (ours;
            [Matheron2020]: 0).
    """

    alpha: int = 10
    stop_at_success: bool = True
    test_threshold: float = 0.95
    skip_unsolved: bool = True
    min_stride: int = 1
    max_stride: int = 1
    rehearsal_fraction: float = 0.0

    def _check_ranges(self) -> None:
        self._check_counts("alpha", "min_stride", "max_stride")
        self._check_fractions("test_threshold", "rehearsal_fraction")
        self._check(f"at least min_stride = {self.min_stride}", lambda value: value >= self.min_stride, "max_stride")


@dataclass
class BackplayState:
    """The variables of Backplay's loop.

    Attributes:
        start: K, the waypoint where episodes start.
        stride: Waypoints between this start point and the next.
        saved: K_s, the start of the best skill so far; -1 when there is none.
        phase: What the next step does. "pretest" tests a new start point before training there; "probe" tests after a
            good session; "test" tests once training has stabilised.
        best: Highest success rate of a session here.
        stagnant_sessions: Sessions since then without a higher one.
        sessions: Training sessions of this skill so far.
        restarted: Whether it was begun again with new networks, having no start point yet.
    """

    start: int
    stride: int
    saved: int = -1
    phase: Literal["pretest", "train", "probe", "test"] = "pretest"
    best: float = -1.0
    stagnant_sessions: int = 0
    sessions: int = 0
    restarted: bool = False


class Backplay:
    """One skill that ends at the trainer's target, trained in small steps that can be interrupted.

    Args:
        trainer: Its target is the end of the skill already.
        settings: Settings of the loop.
        min_index: The waypoint at which the skill is long enough.

    Source: [Matheron2020] Alg. 7. Differs: index 0 is trained too; once a session succeeds, a test may end the
    training loop before alpha sessions without improvement (`stop_at_success`); the stride between start points
    doubles while tests pass and halves when they fail (`min_stride = max_stride = 1` is the thesis); a start point
    that stays partly solved ends the skill unless `skip_unsolved`; a skill that has no start point yet begins again
    with new networks, and if this does not help passes over such start points, as Alg. 7 does. A ball can hold states
    from which there is no short path to a goal nearby, such as those of a car that has passed it and is too slow to
    return.
    """

    def __init__(self, trainer: SkillTrainer, settings: SkillSettings, min_index: int = 0):
        self.trainer = trainer
        self.settings = settings
        self.min_index = min_index
        self.state = BackplayState(self._first_start(), settings.min_stride)
        self.saved_policy: SkillPolicy | None = None
        self.done = False

    def step(self) -> None:
        """Do one session or one test."""
        if self.state.phase == "train":
            self._train()
        else:
            self._test()

    def _train(self) -> None:
        state = self.state
        success = self.trainer.session(state.start, self.settings.rehearsal_fraction)
        state.sessions += 1
        if success > state.best:
            state.best, state.stagnant_sessions = success, 0
        else:
            state.stagnant_sessions += 1
        if state.stagnant_sessions >= self.settings.alpha:
            state.phase = "test"
        elif self.settings.stop_at_success and success >= self.settings.test_threshold:
            state.phase = "probe"

    def _test(self) -> None:
        state, success = self.state, self.trainer.test(self.state.start)
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
        if begun and (success == 0.0 or not self.settings.skip_unsolved):
            self.done = True
        elif success > 0.0 and (begun or state.start > self.min_index) and (
                self.settings.skip_unsolved or state.restarted):
            self._move_on()
        elif self.settings.skip_unsolved:
            self._train_from_here()
        else:
            self._restart()

    def _restart(self) -> None:
        """Train from scratch; the first start point is tried again, and only then start points are passed over."""
        state = self.state
        state.restarted = not state.restarted
        self.trainer.restart()
        state.start = self._first_start()
        self._train_from_here()

    def _first_start(self) -> int:
        return max(self.min_index, self.trainer.end_index - self.settings.min_stride)

    def _train_from_here(self) -> None:
        state = self.state
        state.phase, state.best, state.stagnant_sessions = "train", -1.0, 0

    def _save(self) -> None:
        state = self.state
        if self.saved_policy is not None:
            state.stride = min(2 * state.stride, self.settings.max_stride)
        self.saved_policy, state.saved = self.trainer.policy(), state.start

    def _move_on(self) -> None:
        state = self.state
        self.done = state.start == self.min_index
        state.start = max(self.min_index, state.start - state.stride)
        state.phase = "pretest"

    def _can_come_closer(self) -> bool:
        return self.saved_policy is not None and self.state.saved - self.state.start > self.settings.min_stride

    def to_dict(self) -> dict[str, Any]:
        """Return the loop's variables as plain values."""
        return asdict(self.state)

    def restore(self, values: dict[str, Any], policy: SkillPolicy | None) -> None:
        """Resume from `to_dict()` and the saved policy."""
        self.state = BackplayState(**values)
        self.saved_policy = policy
