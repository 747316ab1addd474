"""`pbcs train`: plan a trajectory, train a controller along it, draw both."""

from argparse import Namespace
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.cli import train_follower
from pbcs_ompl.cli.arguments import build_parser, environment
from pbcs_ompl.cli.finished import lacks_picture_only
from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.pictures import draw_chain
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary, warn
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import format_duration, format_number, format_rate
from pbcs_ompl.core.signals import with_remedy
from pbcs_ompl.core.trust import module_names
from pbcs_ompl.resettable import make
from pbcs_ompl.results.command_line import command, environment_words, eval_words, resume_words
from pbcs_ompl.results.files import CHAIN, CONFIG, TRAJECTORY
from pbcs_ompl.results.folder import RunFolder, read_config, read_folder
from pbcs_ompl.results.trackers import tracker
from pbcs_ompl.skills import TrainResult, resume, train
from pbcs_ompl.skills.load_chain import load_chain
from pbcs_ompl.skills.robots.evaluation import followers_of
from pbcs_ompl.skills.trained_controller import TrainedController

SHOWN = ("phase", "transitions", "updates", "covered", "skills", "seconds", "table")
"""Of the numbers of a training; progress.csv and trackers have all."""


def run(arguments: Namespace) -> int:
    """Train, draw, report. Returns 1 when the chain does not reach the goal."""
    if arguments.resume:
        _refuse_other_options(arguments)
        out = Path(arguments.resume)
        if (out / CONFIG).is_file() and read_config(out)["kind"] == "follower":
            return train_follower.run(arguments)
        if lacks_picture_only(out):
            return _draw_only(out, trust=arguments.trust, as_json=arguments.json)
    elif arguments.lines is not None:
        return train_follower.run(arguments)
    else:
        if arguments.worlds is not None:
            raise InvalidOption("--worlds goes with --lines random")
        if arguments.env is None:
            raise InvalidOption("--env is missing (see pbcs train --help)")
        named = [] if arguments.method is None else [arguments.method]
        out = Path(arguments.out or fresh_folder("train", arguments.env, *named, arguments.seed))
    try:
        result = _train(arguments, out)
    except KeyboardInterrupt as error:
        if (out / CONFIG).is_file():
            again = command(resume_words(out, trust=_names_modules(arguments)))
            raise with_remedy(error, f"continue with: {again}") from None
        raise
    if result.reason is not None:
        warn(result.reason)
    _draw(result.summary(), result.chain, result.trajectory, out)
    print_summary(result.summary(), _closing_lines(arguments, result, out), as_json=arguments.json)
    return 0 if result.solved else 1


def _train(arguments: Namespace, out: Path) -> TrainResult:
    budget = {} if arguments.max_transitions is None else {"max_transitions": arguments.max_transitions}
    tracked = nullcontext() if arguments.track is None else tracker(arguments.track, out)
    with tracked as track, ProgressDisplay("train", budget=arguments.max_transitions) as display:

        def show(numbers: dict[str, Any]) -> None:
            display({name: value for name, value in numbers.items() if name in SHOWN})
            if track is not None:
                track(numbers)

        if arguments.resume:
            return resume(out, trust=arguments.trust, on_progress=show, **budget)
        trajectory = None if arguments.path is None else _read_trajectory(Path(arguments.path))
        return train(environment(arguments), trajectory=trajectory, out=out,
                     method=arguments.method, planner=arguments.planner, planner_kwargs=arguments.planner_kwargs,
                     agent=arguments.agent, preset=arguments.preset, settings=arguments.settings,
                     agent_settings=arguments.agent_settings, seed=arguments.seed, device=arguments.device,
                     on_progress=show, **budget)


def _refuse_other_options(arguments: Namespace) -> None:
    """A resumed run has the settings of its folder; only its budget may change."""
    defaults = vars(build_parser().parse_args(["train"]))
    for name, value in vars(arguments).items():
        if name not in ("resume", "trust", "json", "max_transitions", "track") and value != defaults[name]:
            raise InvalidOption(f"--resume takes every setting but --max-transitions from "
                                f"{arguments.resume}; remove --{name.replace('_', '-')}")


def _read_trajectory(path: Path) -> Trajectory:
    return Trajectory.load(path / TRAJECTORY if path.is_dir() else path)


def _draw_only(out: Path, *, trust: bool, as_json: bool) -> int:
    """Make the picture of a training that was killed after its result."""
    with RunFolder(out, resume=True):
        result = read_folder(out).result or {}
        chain = load_chain(out / CHAIN, trust=trust) if (out / CHAIN).is_dir() else None
        trajectory = Trajectory.load(out / TRAJECTORY) if (out / TRAJECTORY).exists() else None
        _draw(result, chain, trajectory, out)
    print_summary(result, [("solved" if result["solved"] else "not solved", "ended before; its picture is made now"),
                           ("files", list_files(out))], as_json=as_json)
    return 0 if result["solved"] else 1


def _draw(result: dict[str, Any], chain: TrainedController | None, trajectory: Trajectory | None, out: Path) -> None:
    if chain is None:
        return
    model = make(chain.environment)
    rollout = chain.rollout(model) if result["complete"] else None
    title = (f"{model.spec.id}: {_policies(chain)}, "
             f"{result['train_transitions']:,} transitions, {result['updates']:,} updates")
    draw_chain(model, chain, None if trajectory is None else trajectory.states, rollout, title, out)


def _policies(chain: TrainedController) -> str:
    return "1 policy" if chain.num_policies == 1 else f"{chain.num_policies} policies"


def _names_modules(arguments: Namespace) -> bool:
    """Return whether a folder of this command names modules, so that reading it takes --trust."""
    return arguments.trust or any(module_names(list(vars(arguments).values())))


def _closing_lines(arguments: Namespace, result: TrainResult, out: Path) -> list[tuple[str, str]]:
    planned = f"{format_number(result.plan_transitions)} of planning, " if result.plan_transitions else ""
    effort = (f"transitions: {planned}{format_number(result.train_transitions)} of training; "
              f"{format_number(result.updates)} updates, {format_duration(result.seconds)}")
    lines = [("solved" if result.solved else "not solved", effort)]
    if result.chain is not None:
        lines.append(("policies", str(result.chain.num_policies)))
    if result.nominal is not None and result.nominal.steps_median is not None:
        lines.append(("rollout", f"{format_number(result.nominal.steps_median)} steps to the goal without noise"))
    if result.robust is not None:
        rate = format_rate(result.robust.success_rate, result.robust.wilson)
        lines.append(("success", f"{rate} with {result.robust.epsilon:.0%} random actions, in fresh environments"))
    if not result.solved:
        lines += _without_training(arguments)
    lines.append(("files", list_files(out)))
    if result.complete and result.chain is None:
        return lines
    trust = _names_modules(arguments)
    if result.complete:
        return [*lines, ("next", command(eval_words(out, epsilon=0.2, trust=trust)))]
    return [*lines, ("next", f"{command(resume_words(out, trust=trust))} --max-transitions N, with a larger N")]


def _without_training(arguments: Namespace) -> list[tuple[str, str]]:
    """Return how the follower that comes with pbcs drives the robot of the environment, where there is one."""
    if arguments.env is None:
        return []
    spec = environment(arguments)
    names = followers_of(make(spec))
    return [("robot", f"{command(['plan', *environment_words(spec), '--follow', name])} drives along a plan without "
                      "training") for name in names]
