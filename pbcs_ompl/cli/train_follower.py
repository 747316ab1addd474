"""`pbcs train --method follow --lines random`: one policy for any line of a robot."""

from argparse import Namespace
from pathlib import Path
from typing import Any

from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.terminal import ProgressDisplay, list_files, print_summary
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.formatting import format_duration, format_number
from pbcs_ompl.core.signals import with_remedy
from pbcs_ompl.results.command_line import command, resume_words
from pbcs_ompl.results.files import CONFIG
from pbcs_ompl.skills.robots.train import FollowerResult, resume_follower, train_follower

FIXED: dict[str, Any] = {
    "path": None, "planner": None, "planner_kwargs": {}, "goal": None, "feature": None, "start_seed": None,
    "reset_options": None, "agent": "ddpg", "device": "cpu", "preset": "fast"}
"""Options that say nothing about a follower, and the values that they have when they are not given."""
TRANSITIONS = 1_000_000


def run(arguments: Namespace) -> int:
    """Train and report. Returns 0: whether a follower is good enough is for `pbcs eval` to say."""
    if arguments.resume:
        out = Path(arguments.resume)
    else:
        _check(arguments)
        out = Path(arguments.out or fresh_folder("train", arguments.env, "follower", arguments.seed))
    try:
        result = _train(arguments, out)
    except KeyboardInterrupt as error:
        if (out / CONFIG).is_file():
            raise with_remedy(error, f"continue with: {command(resume_words(out, trust=arguments.trust))}") from None
        raise
    effort = (f"{format_number(result.transitions)} transitions, {format_number(result.updates)} updates, "
              f"{format_duration(result.seconds)}")
    lines = [("follower", effort),
             ("test", f"{result.test_rate:.0%} of the test lines without noise, in the worlds of training"),
             ("files", list_files(out)), ("next", f"{command(['eval', str(out)])} --path PLAN")]
    print_summary(result.summary(), lines, as_json=arguments.json)
    return 0


def _check(arguments: Namespace) -> None:
    if arguments.env is None:
        raise InvalidOption("--env is missing (see pbcs train --help)")
    if arguments.method not in (None, "follow"):
        raise InvalidOption(f"--lines goes with --method follow, not with {arguments.method!r}")
    for name, value in FIXED.items():
        if getattr(arguments, name) != value:
            raise InvalidOption(f"--{name.replace('_', '-')} says nothing about the training of a robot's follower, "
                                "which needs no plan and is made by PPO; remove it")


def _train(arguments: Namespace, out: Path) -> FollowerResult:
    budget = arguments.max_transitions
    with ProgressDisplay("train", budget=budget or TRANSITIONS) as display:
        if arguments.resume:
            return resume_follower(out, max_transitions=budget, trust=arguments.trust, on_progress=display)
        return train_follower(arguments.env, env_kwargs=arguments.env_kwargs, worlds=arguments.worlds,
                              settings=arguments.settings, agent_settings=arguments.agent_settings,
                              seed=arguments.seed, max_transitions=budget or TRANSITIONS, out=out, on_progress=display)
