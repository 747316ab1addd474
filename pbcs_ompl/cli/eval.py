"""`pbcs eval`: run a trained controller many times from the start."""

from argparse import Namespace
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from pbcs_ompl.cli import eval_follower
from pbcs_ompl.cli.terminal import print_summary
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import format_number, format_rate
from pbcs_ompl.figures.video import check_video, write_video
from pbcs_ompl.resettable import make
from pbcs_ompl.results.command_line import command, eval_words
from pbcs_ompl.results.files import CHAIN
from pbcs_ompl.results.folder import RunFolder
from pbcs_ompl.skills.evaluation import evaluate
from pbcs_ompl.skills.load_chain import load_chain


def run(arguments: Namespace) -> int:
    """Evaluate and report. Returns 1 when no rollout reached the goal."""
    folder = Path(arguments.dir)
    place = eval_follower.follower_folder(folder)
    if place is not None:
        return eval_follower.run(arguments, place)
    if arguments.path or arguments.env or arguments.env_kwargs or arguments.seed:
        raise InvalidOption("--path, --env, --env-kwargs and --seed are for a robot's follower; a chain of skills "
                            "drives where it was trained")
    chain = load_chain(folder / CHAIN if (folder / CHAIN).is_dir() else folder, trust=arguments.trust)
    if arguments.video:
        check_video(arguments.video)
    with nullcontext() if arguments.out is None else RunFolder(arguments.out) as out:
        evaluation = evaluate(chain, episodes=arguments.episodes, epsilon=arguments.epsilon)
        summary = evaluation.summary()
        if out is not None:
            out.write_config({"kind": "eval", "chain": folder, "episodes": arguments.episodes,
                              "epsilon": arguments.epsilon, "environment": chain.environment.to_dict()})
            out.write_result(summary)
    if arguments.video:
        model = make(chain.environment)
        write_video(model, chain.rollout(model, epsilon=arguments.epsilon), arguments.video)
        summary["video"] = arguments.video
    print_summary(summary, _closing_lines(arguments, summary), as_json=arguments.json)
    return 0 if summary["success_rate"] > 0 else 1


def _closing_lines(arguments: Namespace, summary: dict[str, Any]) -> list[tuple[str, str]]:
    noise = f", {arguments.epsilon:.0%} random actions" if arguments.epsilon else ""
    lines = [("success", format_rate(summary["success_rate"], summary["wilson"])),
             ("rollouts", f"{summary['episodes']} from the start{noise}, in fresh environments")]
    failures = {ending: count for ending, count in summary["endings"].items() if ending != "goal"}
    if failures:
        lines.append(("failed", ", ".join(f"{count} by {ending}" for ending, count in failures.items())))
    if summary["steps_median"] is not None:
        lines.append(("steps", f"{format_number(summary['steps_median'])} to the goal, median"))
    if arguments.video:
        lines.append(("video", arguments.video))
    if not arguments.epsilon:
        lines.append(("next", command(eval_words(arguments.dir, epsilon=0.1, trust=arguments.trust))))
    return lines
