"""`pbcs plan`: search a trajectory to the goal, draw the tree."""

from argparse import Namespace
from pathlib import Path

from pbcs_ompl.bridge.plan import PlanResult, plan
from pbcs_ompl.cli.arguments import environment
from pbcs_ompl.cli.finished import finished_plan
from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.models import ends_hint, note_rules
from pbcs_ompl.cli.pictures import draw_tree
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary
from pbcs_ompl.core.formatting import format_duration, format_number
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.resettable import make
from pbcs_ompl.results.command_line import command, environment_words


def run(arguments: Namespace) -> int:
    """Plan, draw, report. Returns 1 when the environment does not grant the goal: to a plan, or to a follower."""
    out = Path(arguments.out or fresh_folder("plan", arguments.env, arguments.planner, arguments.seed))
    model = make(environment(arguments))
    note_rules(model)
    driver = None
    if arguments.follow or arguments.episodes or arguments.epsilon is not None:
        from pbcs_ompl.cli.plan_follow import Driver  # here, because of torch

        driver = Driver.of(arguments, model)
    if arguments.video:
        from pbcs_ompl.figures.video import check_video  # here, because matplotlib takes a third of a second

        check_video(arguments.video)
    result = finished_plan(arguments, out) or _plan(arguments, model, out)
    if not arguments.no_pictures:
        draw_tree(model, result, out)
    if arguments.video and result.trajectory is not None:
        from pbcs_ompl.figures.video import write_video

        write_video(model, result.trajectory.states, arguments.video)
    summary, lines, done = result.summary(), _closing_lines(arguments, model, result, out), result.solved
    if driver is not None and result.solved and result.trajectory is not None:
        followed = driver.drive(result.trajectory)
        summary, lines = summary | {"followed": followed.summary()}, [*lines[:-2], driver.words(followed), *lines[-2:]]
        done = followed.success_rate > 0
    print_summary(summary, lines, as_json=arguments.json)
    return 0 if done else 1


def _plan(arguments: Namespace, model: ResettableModel, out: Path) -> PlanResult:
    with ProgressDisplay("plan", budget=arguments.max_transitions, max_seconds=arguments.max_seconds) as display:
        return plan(model, arguments.planner, planner_kwargs=arguments.planner_kwargs, seed=arguments.seed,
                    max_transitions=arguments.max_transitions, max_seconds=arguments.max_seconds, out=out,
                    improve=arguments.improve, on_progress=display)


def _closing_lines(arguments: Namespace, model: ResettableModel, result: PlanResult,
                   out: Path) -> list[tuple[str, str]]:
    rate = format_number(result.transitions / max(result.seconds, 1e-9))
    effort = (f"{format_number(result.transitions)} transitions, {format_duration(result.seconds)} "
              f"({rate} transitions/s)")
    lines = [("solved" if result.solved else "not solved", effort), ("tree", f"{format_number(result.nodes)} nodes")]
    if result.solved:
        lines.append(("path", f"{format_number(result.path_length)} steps, verified in a fresh environment"))
        if result.improvement is not None:
            lines.append(("before", f"{format_number(result.improvement.before)} steps; improved with "
                                    f"{format_number(result.improvement.transitions)} transitions, "
                                    f"{format_duration(result.improvement.seconds)}"))
        words = environment_words(environment(arguments))
        following = command(["train", *words, "--path", str(out)])
    elif result.found:
        lines.append(("FAILED", str(result.reason)))
        following = command(["doctor", *environment_words(environment(arguments))])
    else:
        lines += ends_hint(model, result.tree)
        following = "the same with a larger --max-transitions or --max-seconds, or another --planner"
    return [*lines, ("files", list_files(out)), ("next", following)]

