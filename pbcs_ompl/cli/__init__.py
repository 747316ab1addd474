"""The command line: parse, call, print. Each verb is one file of this package, imported when it is used.

Exit status: 0 done, 1 ran and did not solve, 2 wrong usage or input, 3 something is not installed,
130 interrupted.
"""

import sys
import traceback
import warnings
from argparse import Namespace
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from pbcs_ompl.cli.arguments import build_parser, parse
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.formatting import one_line
from pbcs_ompl.core.trust import module_names


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status. Each mistake of the user, and each warning, is one line on stderr."""
    words = list(sys.argv[1:] if argv is None else argv)
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        return _run(words)


def _run(words: list[str]) -> int:
    try:
        arguments = parse(build_parser(), words)
        if _imports(arguments) and "" not in sys.path:
            sys.path.append("")  # `--planner my_module:MyPlanner` finds a module in the working directory
        return int(import_module(f"pbcs_ompl.cli.{arguments.verb}").run(arguments))
    except PbcsError as error:
        return _complain(error, f"error: {error}", error.exit_code)
    except KeyboardInterrupt as error:
        remedy = str(error) or "run the same command again to start over"
        return _complain(error, f"interrupted; {remedy}", 130)


def _imports(arguments: Namespace) -> bool:
    """Return whether a command imports what the user has: else nothing in the working directory is imported."""
    return (arguments.verb == "study" or getattr(arguments, "trust", False)
            or any(module_names(list(vars(arguments).values()))))


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    print("pbcs: warning:", one_line(str(message)), file=sys.stderr)


def _complain(error: BaseException, message: str, status: int) -> int:
    """Print one line, and let go of what the failed call held: OMPL's bindings list it as leaked at exit."""
    print("pbcs:", one_line(message), file=sys.stderr)
    link: BaseException | None = error
    while link is not None:
        traceback.clear_frames(link.__traceback__)
        link.__traceback__ = None
        link = link.__cause__ or link.__context__
    return status
