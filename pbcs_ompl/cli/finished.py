"""Runs that were killed between their result and its picture: the same command makes what is missing."""

from argparse import Namespace
from pathlib import Path

from pbcs_ompl.bridge.plan import PlanResult, read_plan
from pbcs_ompl.cli.arguments import environment
from pbcs_ompl.results.files import CHECKPOINT, CONFIG, RESULT, is_there, read_toml
from pbcs_ompl.results.folder import RunFolder

TREE_PICTURE, CHAIN_PICTURE = "tree.png", "chain.png"


def finished_plan(arguments: Namespace, out: Path) -> PlanResult | None:
    """Return the result in `out` if these arguments have led to it and it lacks its picture, else None.

    Raises:
        DamagedFile: a file in the folder is damaged.
    """
    if not (out / CONFIG).is_file() or not (out / RESULT).is_file() or (out / TREE_PICTURE).exists():
        return None
    config = read_toml(out / CONFIG)
    asked = {"kind": "plan", "planner": arguments.planner, "seed": arguments.seed,
             "max_transitions": arguments.max_transitions, "environment": environment(arguments).to_dict()}
    same = all(config.get(name) == value for name, value in asked.items())
    same &= all(config.get(name) == getattr(arguments, name) for name in ("max_seconds", "improve"))
    used = config.get("planner_kwargs", {})
    same &= all(used.get(name) == value for name, value in arguments.planner_kwargs.items())
    if not same:
        return None
    with RunFolder(out, resume=True):
        return read_plan(out)


def lacks_picture_only(out: Path) -> bool:
    """Return whether the training in a folder has ended and only its picture is missing."""
    return ((out / RESULT).is_file() and not is_there(out / CHECKPOINT) and (out / CONFIG).is_file()
            and not (out / CHAIN_PICTURE).exists())
