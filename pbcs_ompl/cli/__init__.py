"""The command line: parse, call, print. Each verb is one file of this package, imported when it is used.

Exit status: 0 done, 1 ran and did not solve, 2 wrong usage or input, 3 something is not installed,
4 a mistake in pbcs itself, 128+n stopped by signal n (130 for Ctrl-C, 141 for a pipe that was closed).
"""

import atexit
import gc
import sys
import traceback
import warnings
from argparse import Namespace
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import Any

from pbcs_ompl.cli.arguments import build_parser, parse
from pbcs_ompl.cli.folders import check_exists
from pbcs_ompl.cli.streams import OutputClosed, flush_output, print_error, survive_encodings
from pbcs_ompl.core.collector import no_collection
from pbcs_ompl.core.errors import MissingDependency, PbcsError
from pbcs_ompl.core.formatting import one_line
from pbcs_ompl.core.signals import interruptible, signal_of, signals_interrupt
from pbcs_ompl.core.trust import module_names

MOST_LETTERS = 100
"""Of a name that is shown."""
OF_TRAINING = ("torch", "safetensors")
"""Libraries that only training and what it leads to need."""
COLLECTION = 100_000
"""Objects that are made between collections of garbage; a compilation makes millions."""
OF_FOLDERS = ("eval", "export", "distill", "view")
WRONG_INPUT, OUR_MISTAKE, STOPPED, SIGPIPE = 2, 4, 128, 13
atexit.register(gc.disable)  # at its end Python then looks at all objects once instead of three times: 0.25 s less


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status. Each mistake of the user, and each warning, is one line on stderr."""
    words = list(sys.argv[1:] if argv is None else argv)
    survive_encodings()
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        try:
            return _run(words)
        finally:
            gc.unfreeze()  # else OMPL's bindings list all that they hold as leaked at exit


def _run(words: list[str]) -> int:
    try:
        with signals_interrupt():
            status = _dispatch(words)
            flush_output()
            return status
    except PbcsError as error:
        return _complain(error, f"error: {error}", error.exit_code)
    except KeyboardInterrupt as error:
        remedy = str(error) or "run the same command again to start over"
        return _complain(error, f"interrupted; {remedy}", STOPPED + signal_of(error))
    except OutputClosed:
        return STOPPED + SIGPIPE
    except OSError as error:  # of a file that cannot be read, for instance
        return _complain(error, f"error: {error.strerror or error}: {str(error.filename)[:MOST_LETTERS]}", WRONG_INPUT)
    except MemoryError as error:
        return _complain(error, f"error: out of memory; {error}", WRONG_INPUT)
    except Exception as error:
        print_error(traceback.format_exc().rstrip())
        return _complain(error, "error: this is a mistake in pbcs; please report it with the lines above", OUR_MISTAKE)


def _dispatch(words: list[str]) -> int:
    """Parse and run a command; only the parser may end it, after --help and --version.

    Raises:
        MissingDependency: it needs what only training needs, and that is not installed.
    """
    arguments = parse(build_parser(), words)
    if arguments.verb in OF_FOLDERS:  # which import torch first
        check_exists(arguments.dir)
    if _imports(arguments) and "" not in sys.path:
        sys.path.append("")  # `--planner my_module:MyPlanner` finds a module in the working directory
    try:
        return int(_import(arguments.verb).run(arguments))
    except ModuleNotFoundError as error:
        if error.name not in OF_TRAINING:
            raise
        remedy = 'pip install "pbcs-ompl[rl]"'
        raise MissingDependency(f"pbcs {arguments.verb} needs {error.name} for this: {remedy}") from error
    except SystemExit as error:
        raise PbcsError(f"code that pbcs {arguments.verb} has called left with sys.exit({error.code!r})") from error


def _import(verb: str) -> ModuleType:
    """Return the module of a verb; a signal waits, since an exception within an import of OMPL ends the process."""
    stops: list[KeyboardInterrupt] = []
    with interruptible(stops.append), no_collection():
        module = import_module(f"pbcs_ompl.cli.{verb}")
    gc.freeze()  # what was imported stays: no collection needs to look at it
    gc.set_threshold(COLLECTION, 20, 20)
    if stops:
        raise stops[0]
    return module


def _imports(arguments: Namespace) -> bool:
    """Return whether a command imports what the user has: else nothing in the working directory is imported."""
    return (arguments.verb == "study" or getattr(arguments, "trust", False)
            or any(module_names(list(vars(arguments).values()))))


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    print_error(f"pbcs: warning: {one_line(str(message))}")


def _complain(error: BaseException, message: str, status: int) -> int:
    """Print one line, and let go of what the failed call held: OMPL's bindings list it as leaked at exit."""
    print_error(f"pbcs: {one_line(message)}")
    link: BaseException | None = error
    while link is not None:
        traceback.clear_frames(link.__traceback__)
        link.__traceback__ = None
        link = link.__cause__ or link.__context__
    return status
