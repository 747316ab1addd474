"""Settings of the training of a robot's follower."""

from dataclasses import dataclass, field

from pbcs_ompl.skills.settings import Settings


@dataclass(frozen=True)
class RobotLineSettings(Settings):
    """The lines, and what the policy sees of them; lengths in the unit of the environment, here for MuJoCo's ant.

    Attributes:
        lines_per_world: Random lines for training in each world (ours).
        tests_per_world: Random lines for tests in each world (ours).
        longest: Length of the longest line (ours).
        spacing: Between the points of a line (ours).
        clearance: The least distance of lines from walls (ours: an ant's legs reach 0.9 m).
        look_ahead: How far the policy sees the line: near, middle, far (ours). The side that leads looks to the middle.
        window: The longest move of a pointer in a step (ours).
        goal_radius: Distance from the end of a line that is a success: 0.45 m in gymnasium-robotics.
    """

    lines_per_world: int = 48
    tests_per_world: int = 3
    longest: float = 25.0
    spacing: float = 0.05
    clearance: float = 0.6
    near: float = 0.5
    middle: float = 1.5
    far: float = 3.0
    window: float = 1.0
    goal_radius: float = 0.45

    def _check_ranges(self) -> None:
        self._check_counts("lines_per_world", "tests_per_world")
        self._check_positive("longest", "spacing", "clearance", "near", "middle", "far", "window", "goal_radius")


@dataclass(frozen=True)
class RobotStartSettings(Settings):
    """Where episodes begin.

    Attributes:
        standing: Fraction that begins as the environment's resets do, on a line, in any direction (ours).
        advanced: Fraction that begins in own states from which an episode advanced by `advance` or more (ours).
        stalled: Fraction that begins where an own episode stalled (ours). The others stumble, with random actions.
        advance: A length (ours).
        stumbles: Steps of random actions at most (ours).
        control_duration: Steps for which these hold an action (ours).
    """

    standing: float = 0.3
    advanced: float = 0.35
    stalled: float = 0.15
    advance: float = 1.0
    stumbles: int = 60
    control_duration: int = 5

    def _check_ranges(self) -> None:
        self._check_fractions("standing", "advanced", "stalled")
        self._check("at most 1 together with the others", lambda value: self.standing + self.advanced + value <= 1.0,
                    "stalled")
        self._check_positive("advance")
        self._check_counts("stumbles", "control_duration")


@dataclass(frozen=True)
class RobotSettings(Settings):
    """Settings of the training of a robot's follower; all of them ours, found with Gymnasium's ant.

    Attributes:
        lines: The lines.
        starts: Where episodes begin.
        progress_reward: For each unit of length along the line.
        success_reward: At its end.
        effort: Cost of the squared actions, in half-widths of the box.
        stray_cost: Cost of a step for each unit of length away from the line.
        crash_cost: Cost of an episode that the environment terminates.
        progress_length: Length l of the discount exp(-progress / l): with a discount by time alone, to dash and fall is
            worth more than to walk.
        patience: Steps without progress after which an episode has failed.
        max_steps: Length of an episode.
        epsilon: Fraction of random actions.
        robots: Episodes side by side.
        horizon: Steps of each between two iterations of PPO.
        test_transitions: Transitions between two tests.
        test_steps: Length of the episodes of a test.
    """

    lines: RobotLineSettings = field(default_factory=RobotLineSettings)
    starts: RobotStartSettings = field(default_factory=RobotStartSettings)
    progress_reward: float = 5.0
    success_reward: float = 10.0
    effort: float = 0.02
    stray_cost: float = 0.0
    crash_cost: float = 0.0
    progress_length: float = 4.0
    patience: int = 30
    max_steps: int = 300
    epsilon: float = 0.1
    robots: int = 64
    horizon: int = 48
    test_transitions: int = 200_000
    test_steps: int = 1500

    def _check_ranges(self) -> None:
        self._check_positive("progress_length")
        self._check_fractions("epsilon")
        self._check_counts("patience", "max_steps", "robots", "horizon", "test_transitions", "test_steps")
        self._check_at_least(0, "progress_reward", "success_reward", "effort", "stray_cost", "crash_cost")
