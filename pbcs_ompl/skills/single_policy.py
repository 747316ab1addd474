"""The methods of [Matheron2020] chapters 4 and 5: one policy from the start to the goal."""

import sys
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from typing import Any

from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.exploration import explore
from pbcs_ompl.skills.method import Snapshot, TrainingMethod
from pbcs_ompl.skills.settings import MethodSettings, PlannedSettings
from pbcs_ompl.skills.trainer import SkillTrainer


@dataclass
class SinglePolicyState:
    """The variables of the loop of a method with one policy.

    Attributes:
        start: The waypoint where episodes start.
        sessions: Sessions at this place so far.
        tested: Whether this start point has been tested since the last change.
        success_rate: Of the last session or test.
        solved: Whether the policy has passed its last test, from waypoint 0.
        filled: Whether the replay buffer has been filled beforehand, by methods that do so.
    """

    start: int
    sessions: int = 0
    tested: bool = False
    success_rate: float = 0.0
    solved: bool = False
    filled: bool = False


class SinglePolicy(TrainingMethod, ABC):
    """A single policy that is trained to reach the environment's goal.

    Args:
        trainer: What trains the agent.
        first_start: The waypoint where training begins.
    """

    def __init__(self, trainer: SkillTrainer, first_start: int = 0):
        self.trainer = trainer
        self.state = SinglePolicyState(first_start)

    @abstractmethod
    def step(self) -> None:
        """Do one session or one test."""

    @property
    def done(self) -> bool:
        """Whether the policy reaches the goal from the start."""
        return self.state.solved

    @property
    def skills(self) -> list[Skill]:
        """The policy as a chain of one skill."""
        return [self.trainer.skill(0, self.trainer.policy())]

    @property
    def covered(self) -> float:
        """Fraction of the plan behind the present start point; without a plan, 0 or 1."""
        return 1.0 if self.done else 1.0 - self.state.start / self.trainer.waypoints.last

    @property
    def standing(self) -> str:
        """How far training has come, in words, and what stands in the way."""
        return f"{self.covered:.0%} of the plan covered; {self._obstacle}"

    @property
    def _obstacle(self) -> str:
        """The start point that training has not passed yet, in words."""
        start, trainer = self.state.start, self.trainer
        place = trainer.waypoints.states[start:start + 1]
        return (f"from its waypoint {start}, {float(trainer.model.goal_distance(place)[0]):.3g} from the goal, "
                f"{self.state.success_rate:.0%} of the last episodes of at most {trainer.limit(start)} steps succeeded")

    @property
    def longest_step(self) -> int:
        """The most transitions that the next step may take: those of a session, and of drawing its start states."""
        return sys.maxsize if self.done else 2 * self.trainer.settings.beta * self.trainer.limit(0)

    def chain(self, steps_per_skill: int) -> SkillChain:
        """Return the policy as a chain of one skill.

        Args:
            steps_per_skill: Time limit of an execution, if that is more than the environment's.
        """
        return SkillChain.of(self.skills, self.trainer.waypoints,
                             max(steps_per_skill, self.trainer.model.max_episode_steps))

    def _train_at(self, start: int, rehearsal_fraction: float = 0.0) -> None:
        self.state.success_rate = self.trainer.session(start, rehearsal_fraction)

    def _passes(self, start: int) -> bool:
        self.state.success_rate = self.trainer.test(start)
        return self.state.success_rate == 1.0

    def snapshot(self) -> Snapshot:
        """Return everything needed to resume bit for bit."""
        plain, arrays = self.trainer.state()
        return Snapshot({"trainer": plain, "state": asdict(self.state)}, arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Resume from what `snapshot` returned."""
        self.trainer.restore(snapshot.plain["trainer"], snapshot.arrays)
        values: dict[str, Any] = snapshot.plain["state"]
        self.state = SinglePolicyState(**values)


@dataclass(frozen=True)
class PBSettings(PlannedSettings):
    """Settings of the method "pb".

    Attributes:
        min_stride: Waypoints between start points ([Matheron2020]: 1).
        pretest: Test a new start point before training there ([Matheron2020] Fig. 5.1(b)).
        rehearsal_fraction: Fraction of training episodes that start from a random waypoint passed before (ours;
            [Matheron2020]: 0).
    """

    min_stride: int = 1
    pretest: bool = True
    rehearsal_fraction: float = 0.0

    def _check_ranges(self) -> None:
        self._check_counts("min_stride")
        self._check_fractions("rehearsal_fraction")


class PB(SinglePolicy):
    """Plan, Backplay: the start moves back as soon as every test episode succeeds.

    Source: [Matheron2020] section 5.3, Fig. 5.1(a), and with `pretest` Fig. 5.1(b). Differs: `rehearsal_fraction`;
    starts in balls unless `exact`, which is the thesis.
    """

    def __init__(self, trainer: SkillTrainer, settings: PBSettings):
        super().__init__(trainer, max(0, trainer.waypoints.last - settings.min_stride))
        self.settings = settings

    def step(self) -> None:
        """Test the start point (before training too, with `pretest`), or train there for a session."""
        state = self.state
        if state.tested or (state.sessions == 0 and not self.settings.pretest):
            self._train_at(state.start, self.settings.rehearsal_fraction)
            state.sessions += 1
            state.tested = False
        elif self._passes(state.start):
            state.solved = state.start == 0
            state.start = max(0, state.start - self.settings.min_stride)
            state.sessions = 0
        else:
            state.tested = True


@dataclass(frozen=True)
class BackplaySettings(PlannedSettings):
    """Settings of the method "backplay".

    Attributes:
        window: Fraction of the plan that a window of start points spans (ours, not tuned).
        window_sessions: Sessions in each window (ours, not tuned).
    """

    window: float = 0.1
    window_sessions: int = 10

    def _check_ranges(self) -> None:
        self._check_positive("window")
        self._check_counts("window_sessions")


class SlidingWindow(SinglePolicy):
    """The original Backplay: start points are drawn from a window that slides back on a schedule.

    Source: Resnick et al. 2018, as in [Matheron2020] section 5.2. Differs: starts in balls unless `exact`; once the
    window has reached the start, the policy is tested there after every session and training continues until it passes.
    """

    def __init__(self, trainer: SkillTrainer, settings: BackplaySettings):
        self.settings = settings
        self.width = max(1, round(settings.window * trainer.waypoints.last))
        super().__init__(trainer, max(0, trainer.waypoints.last - self.width))

    def step(self) -> None:
        """Train for a session in the window; move it when its time is over; test at the start."""
        state, trainer = self.state, self.trainer
        if state.tested:
            state.tested = False
            state.solved = self._passes(0)
            return
        end = min(state.start + self.width, trainer.waypoints.last)
        state.success_rate = trainer.session_from(trainer.rng.integers(state.start, end, trainer.settings.beta))
        state.sessions += 1
        if state.start == 0:
            state.tested = True
        elif state.sessions >= self.settings.window_sessions:
            state.start, state.sessions = max(0, state.start - self.width), 0


@dataclass(frozen=True)
class PlainSettings(MethodSettings):
    """Settings of the method "plain"."""


class Plain(SinglePolicy):
    """The agent alone: nothing of a plan is used.

    Every episode starts at the environment's start, as in [Matheron2020] 5.6, or in the ball around it unless `exact`.
    """

    def __init__(self, trainer: SkillTrainer, settings: MethodSettings):
        super().__init__(trainer)

    @property
    def covered(self) -> float:
        """0 or 1: there is no plan."""
        return float(self.done)

    @property
    def standing(self) -> str:
        """What stands in the way, in words."""
        return f"no policy that passes its test: {self._obstacle}"

    def step(self) -> None:
        """Train for a session from the start, then test there."""
        state = self.state
        if state.tested:
            state.tested = False
            state.solved = self._passes(0)
        else:
            self._train()
            state.sessions += 1
            state.tested = True

    def _train(self) -> None:
        self._train_at(0)


@dataclass(frozen=True)
class OfflineSettings(MethodSettings):
    """Settings of the methods "bootstrapped" and "offline".

    Attributes:
        prefill_transitions: Transitions of Ex that fill the replay buffer first ([Matheron2020] section 4.4).
    """

    prefill_transitions: int = 10_000

    def _check_ranges(self) -> None:
        self._check_counts("prefill_transitions")


class Bootstrapped(Plain):
    """One policy from the environment's start; the replay buffer is filled with an exploration of Ex beforehand.

    The exploration counts as training transitions. Then the agent trains and is tested as in `Plain`.

    Source: [Matheron2020] 4.4, "bootstrapped DDPG".
    """

    def __init__(self, trainer: SkillTrainer, settings: OfflineSettings):
        super().__init__(trainer, settings)
        self.settings = settings

    def step(self) -> None:
        """Explore first; then train for a session and test in turn."""
        if self.state.filled:
            super().step()
        else:
            self._fill()
            self.state.filled = True

    def _fill(self) -> None:
        """Fill the replay buffer with transitions of Ex, as far as the budget allows."""
        trainer = self.trainer
        count = min(self.settings.prefill_transitions, trainer.counter.left)
        found = explore(trainer.model, count, int(trainer.rng.integers(2**31)))
        trainer.counter.spend(len(found.rewards))
        trainer.add_transitions(found.states, found.controls, found.rewards, found.next_states, found.terminals)


class Offline(Bootstrapped):
    """An agent that learns from an exploration of Ex alone; its own steps are only those of the tests.

    A session is as many updates as `beta` episodes of full length would bring.

    Source: [Matheron2020] 4.4, "offline DDPG".
    """

    def _train(self) -> None:
        settings = self.trainer.settings
        self.trainer.agent.train(round(settings.beta * self.trainer.limit(0) * settings.updates_per_transition))
