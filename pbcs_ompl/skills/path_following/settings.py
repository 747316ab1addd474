"""What can be set in path following."""

from dataclasses import dataclass, field

import numpy as np

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.skills.path_following.task import LOOKS, LineSettings
from pbcs_ompl.skills.sequential_test import SequentialTest
from pbcs_ompl.skills.settings import AgentSpaces, PlannedSettings


@dataclass(frozen=True)
class FollowSettings(PlannedSettings):
    """Settings of the method "follow"; those of the groups `starts` and `plan`, but `improve`, have no meaning for it.

    A step is worth progress_reward * (its progress - stray_cost * how much further from the line it led, in steps)
    - effort_cost * (mean square of the action, in [-1, 1]), and `episodes.success_reward` more at the end, but as much
    less where the environment terminates an episode elsewhere (ours: a crash is then worse than a stop).

    Attributes:
        line: The plan as a line, and how policies see it.
        gate: When a policy passes.
        stress: A new policy is tested with this many times the random actions of `test_epsilon`, and passes at as many
            times the failure rates of `gate` (ours). With more random actions there are more failures, about in
            proportion, and fewer executions show what a policy is worth. 1 for no stress.
        progress_reward: For the progress of a step (ours: with 1, the actor saturates and fewer mazes are solved).
        stray_cost: For the distance to the line (ours; with 0, policies move along the line beside it: a quadrotor at
            the speed of its plan in another place. With 1, policies pass after fewer sessions in mazes, too).
        effort_cost: For the largest action (ours: without it, actions saturate; with 0.3, mazes take a tenth fewer
            transitions than with 0.1, but where large actions are needed all the time, effort costs what progress is
            worth).
        action_noise: Deviation of the noise on actions in training, actions in [-1, 1] (ours; 0.3 to 0.5 were equal).
        start_fraction: Fraction of episodes that begin in the plan's first state, not anywhere on it (ours, not tuned).
        retry_fraction: Fraction of them that begin where executions of the last refused test came to a stop (ours).
        session_lengths: Transitions of a session between two tests, in hops of the plan without its loops (ours: a test
            without noise costs about a tenth).
        test_share: Transitions of a session, at least, for each of the test before it (ours: a test that refuses a
            good policy is dear).
        averaging: Part of a session over which policies are averaged, exponentially. It is the average that is tested
            and kept (ours: in short sessions that of the agent's target networks; with 0, the last policy, tests fail
            more often).
        attempts: Tests that a policy may fail before training begins again or the line is split (ours; 6 and 10 were
            equal in mazes). Each time that training begins again, its sessions are twice as long.
        longest_horizon: Each time that training begins again, the agent's horizon 1 / (1 - discount) is twice as long,
            up to this many times that of its settings (ours: with a short one, it does not learn to fly).
    """

    line: LineSettings = field(default_factory=LineSettings)
    gate: SequentialTest = field(default_factory=SequentialTest)
    stress: float = 3.0
    progress_reward: float = 0.3
    stray_cost: float = 1.0
    effort_cost: float = 0.1
    action_noise: float = 0.3
    start_fraction: float = 0.1
    retry_fraction: float = 0.3
    session_lengths: int = 10
    test_share: float = 0.5
    averaging: float = 0.2
    attempts: int = 6
    longest_horizon: float = 4.0

    def _check_ranges(self) -> None:
        self._check_positive("progress_reward")
        self._check_at_least(0, "stray_cost", "effort_cost", "action_noise", "test_share")
        self._check_fractions("start_fraction", "retry_fraction", "averaging")
        self._check_at_least(1, "longest_horizon", "stress")
        self.gate.with_failures(self.stress)
        self._check_counts("session_lengths", "attempts")

    def agent_spaces(self, model: ResettableModel) -> AgentSpaces:
        """Return what agents see, as `LineView` shows it, and do: controls scaled to [-1, 1]."""
        ones = np.ones(len(model.action_low))
        return AgentSpaces(model.observation_size + len(LOOKS) * len(model.feature_low) + 1, -ones, ones)
