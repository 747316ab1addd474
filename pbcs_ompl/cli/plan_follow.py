"""`pbcs plan --follow`: a robot's follower drives along the plan that was found, without any training."""

from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.cli.eval_follower import follower_folder
from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.core.formatting import format_number, format_rate
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.skills.evaluation import Evaluation
from pbcs_ompl.skills.robots.evaluation import check_robot, drive, smoothed_line
from pbcs_ompl.skills.robots.follower import RobotFollower, shipped_followers

EPISODES = 30


@dataclass(frozen=True)
class Driver:
    """A follower that is to drive along a plan, and how often.

    Attributes:
        follower: Of the robot of `model`.
        model: Its fresh environments are driven in, from their own starts.
        episodes: Number of executions.
        epsilon: Fraction of random actions.
        seed: Of the resets and the random actions.
    """

    follower: RobotFollower
    model: ResettableModel
    episodes: int
    epsilon: float
    seed: int

    @classmethod
    def of(cls, arguments: Namespace, model: ResettableModel) -> "Driver":
        """Return that of --follow, before anything is planned.

        Raises:
            InvalidOption: --episodes or --epsilon without --follow.
            UnknownName: there is no such follower.
            Mismatch: it is that of another robot.
        """
        if arguments.follow is None:
            raise InvalidOption("--episodes and --epsilon are for executions by a follower; add --follow FOLLOWER, or "
                                "leave them out")
        folder = follower_folder(Path(arguments.follow))
        if folder is None:
            raise UnknownName("follower", str(arguments.follow), shipped_followers())
        follower = RobotFollower.load(folder)
        check_robot(follower, model)
        return cls(follower, model, arguments.episodes or EPISODES, arguments.epsilon or 0.0, arguments.seed)

    def drive(self, trajectory: Trajectory) -> Evaluation:
        """Let the follower drive along the smoothed plan."""
        line = smoothed_line(self.follower, self.model, trajectory)
        return drive(self.follower, self.model, line, episodes=self.episodes, epsilon=self.epsilon, seed=self.seed)

    def words(self, found: Evaluation) -> tuple[str, str]:
        """Return how that went, as a line of a summary."""
        noise = f", {found.epsilon:.0%} random actions" if found.epsilon else ""
        steps = "" if found.steps_median is None else f"; {format_number(found.steps_median)} steps, median"
        return "followed", f"{format_rate(found.success_rate, found.wilson)}, N = {found.episodes}{noise}{steps}"
