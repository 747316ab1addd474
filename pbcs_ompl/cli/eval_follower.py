"""`pbcs eval` of a robot's follower: drive along a plan, or along the shortest way to the goal."""

from argparse import Namespace
from pathlib import Path

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import format_number, format_rate
from pbcs_ompl.results.files import FOLLOWER, TRAJECTORY
from pbcs_ompl.skills.robots.evaluation import evaluate_follower
from pbcs_ompl.skills.robots.follower import STRUCTURE, RobotFollower, shipped_followers


def follower_folder(folder: Path) -> Path | None:
    """Return where a folder, or one of that name in the package, has a follower; None where there is none."""
    if not folder.exists() and str(folder) in shipped_followers():
        return shipped_followers()[str(folder)]
    return next((place for place in (folder / FOLLOWER, folder) if (place / STRUCTURE).is_file()), None)


def run(arguments: Namespace, folder: Path) -> int:
    """Evaluate and report. Returns 1 when no execution reached the goal."""
    if arguments.video or arguments.out:
        raise InvalidOption("--video and --out are for chains of skills; leave them out for a follower")
    if (arguments.path is None) == (arguments.env is None):
        raise InvalidOption("a follower drives along any line: say --path PLAN, or --env ID for the shortest way "
                            "to its goal, and not both")
    follower = RobotFollower.load(folder, trust=arguments.trust)
    trajectory = None
    if arguments.path is not None:
        path = Path(arguments.path)
        trajectory = Trajectory.load(path / TRAJECTORY if path.is_dir() else path, trust=arguments.trust)
    found = evaluate_follower(follower, arguments.env, trajectory=trajectory, env_kwargs=arguments.env_kwargs,
                   episodes=arguments.episodes, epsilon=arguments.epsilon, seed=arguments.seed)
    noise = f", {arguments.epsilon:.0%} random actions" if arguments.epsilon else ""
    lines = [("success", format_rate(found.success_rate, found.wilson)),
             ("executions", f"{found.episodes} from the environment's own starts{noise}, in fresh environments")]
    failures = {ending: count for ending, count in found.endings.items() if ending != "goal"}
    if failures:
        lines.append(("failed", ", ".join(f"{count} by {ending}" for ending, count in failures.items())))
    if found.steps_median is not None:
        lines.append(("steps", f"{format_number(found.steps_median)} to the goal, median"))
    print_summary(found.summary(), lines, as_json=arguments.json)
    return 0 if found.success_rate > 0 else 1
