"""`pbcs demo`: what the toolkit does, in one command that needs no options and no checkout."""

from argparse import Namespace
from importlib import import_module
from importlib.util import find_spec

from pbcs_ompl.cli.arguments import build_parser, parse
from pbcs_ompl.cli.folders import fresh_folder
from pbcs_ompl.cli.lists import MISSING_TORCH
from pbcs_ompl.cli.terminal import warn

TASK = ["--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 5, "maze_seed": 1}', "--seed", "0"]


def run(arguments: Namespace) -> int:
    """Train in a 5x5 maze; without torch, plan there and say what training needs."""
    words = [*TASK, "--out", str(arguments.out or fresh_folder("demo")), *(["--json"] if arguments.json else [])]
    if find_spec("torch") is None or find_spec("safetensors") is None:
        warn(f"training {MISSING_TORCH}; this is the plan alone")
        return _run("plan", words)
    return _run("train", words)


def _run(verb: str, words: list[str]) -> int:
    return int(import_module(f"pbcs_ompl.cli.{verb}").run(parse(build_parser(), [verb, *words])))
