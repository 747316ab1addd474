"""Completion of command lines by the shell; shtab makes it from the parser."""

import argparse
from collections.abc import Callable, Iterator

from pbcs_ompl.cli.values import Choice
from pbcs_ompl.core.errors import MissingDependency


def completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return what a shell reads to complete verbs, options, files, and the names that are registered here.

    Args:
        parser: That of all verbs; its actions get what they are completed with.
        shell: "bash", "zsh" or "fish".

    Raises:
        MissingDependency: shtab is not installed.
    """
    try:
        import shtab
    except ModuleNotFoundError as error:
        raise MissingDependency("completion needs shtab: pip install shtab") from error
    files = {"DIR": shtab.DIRECTORY, "FILE": shtab.FILE}
    known: dict[str, Callable[[], list[str]]] = {"planner": _planners, "planners": _planners, "agent": _agents,
                                                 "env": _environments}
    for action in _actions(parser):
        if action.metavar in files:
            action.complete = files[str(action.metavar)]  # type: ignore[attr-defined]
        elif isinstance(action.type, Choice):
            action.choices = action.type.names
        elif action.dest in known:
            action.choices = known[action.dest]()
    script: str = shtab.complete(parser, shell)
    return script


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of a parser and of its verbs."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                yield from _actions(verb)
        else:
            yield action


def _planners() -> list[str]:
    from pbcs_ompl.core.registry import names

    return names("planner")


def _agents() -> list[str]:
    from pbcs_ompl.core.registry import names

    return names("agent")


def _environments() -> list[str]:
    import gymnasium

    from pbcs_ompl.core.registry import load_environments

    load_environments()
    return sorted(gymnasium.registry)
