"""Errors that name the mistake and the remedy.

Every mistake of a user ends in one of these. The command line prints the message as one line and leaves with
`exit_code`: 2 for wrong input, 3 for something that is not installed.
"""

from collections.abc import Iterable
from difflib import get_close_matches


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """Return '; did you mean X?' for the closest choice, else the list of all choices."""
    choices = sorted(choices)
    folded = {choice.lower(): choice for choice in choices}
    close = get_close_matches(str(name).lower(), folded, n=1, cutoff=0.5)
    if close:
        return f"; did you mean {folded[close[0]]!r}?"
    return f"; choose from {', '.join(choices)}" if choices else ""


class PbcsError(Exception):
    """Base of all errors that a user can fix."""

    exit_code = 2


class UnknownName(PbcsError):
    """A name that no registry knows.

    Args:
        kind: What it should name.
        name: The name.
        choices: Those that are known; the closest one is suggested.
        remedy: What else to try.
    """

    def __init__(self, kind: str, name: str, choices: Iterable[str], remedy: str = ""):
        super().__init__(f"unknown {kind} {name!r}{did_you_mean(name, choices)}{remedy}")


class InvalidOption(PbcsError):
    """An option that does not exist, or a value outside of its range."""


class InvalidState(PbcsError):
    """A state in which the environment cannot be: inside a wall, outside the bounds, or not finite."""


class UnsupportedSpace(PbcsError):
    """An observation or action space that the toolkit cannot work with."""


class NotResettable(PbcsError):
    """An environment that offers no way to restore a state."""


class NotVerified(PbcsError):
    """What a planner or a trainer believes cannot be tried in a fresh environment, so nothing is called solved."""


class BudgetUsedUp(PbcsError):
    """More transitions were asked for than are left of a budget. Ends a training; users do not meet it."""


class PlannerUnavailable(PbcsError):
    """A planner that the installed OMPL cannot build from Python."""

    exit_code = 3


class MissingDependency(PbcsError):
    """A library that is not installed. The message says what to install."""

    exit_code = 3


class CallbackFailed(PbcsError):
    """A user's propagator, strategy, reward or goal raised or returned NaN; the cause is chained."""


class DamagedFile(PbcsError):
    """A file that is truncated, of another version, or not ours."""


class UntrustedModule(PbcsError):
    """A file names a module that would be imported; files of others are data, until the user says otherwise."""


class Mismatch(PbcsError):
    """Two things that do not belong together, such as a path and another environment."""


class RunFolderError(PbcsError):
    """A result folder that exists, is in use by another process, or cannot be written."""
