"""What code of others may return or raise: finite states, and exceptions that become one named error."""

from typing import Any

import numpy as np

from pbcs_ompl.core.errors import CallbackFailed, PbcsError
from pbcs_ompl.core.types import Array


def describe(error: BaseException) -> str:
    """Return the type and the message of an exception as one line, even where its message cannot be read."""
    try:
        text = " ".join(str(error).split()) or "no message"
    except Exception as second:  # its __str__ is code of others, too
        text = f"its message cannot be read: {type(second).__name__}"
    return f"{type(error).__name__}: {text}"


def callback_failed(error: BaseException, source: str = "the environment, goal or planner") -> CallbackFailed:
    """Return the one-line error for an exception of a user's code; raise it `from` that exception."""
    return CallbackFailed(f"{source} raised {describe(error)}")


class code_of_others:
    """Turn whatever the code of others raises, `sys.exit` too, into one named error; our own errors and Ctrl-C pass.

    A context, and a class because it is entered for every step of an execution.

    Args:
        source: Whose code it is, as in "the environment 'Reacher-v5'".

    Raises:
        CallbackFailed: names the exception, which is chained.
    """

    def __init__(self, source: str = "the environment, goal or planner"):
        self._source = source

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Pass on our own errors, and turn those of others into one."""
        if isinstance(error, Exception | SystemExit) and not isinstance(error, PbcsError):
            raise callback_failed(error, self._source) from error


def check_finite(before: Array, controls: Array, after: Array) -> None:
    """Refuse next states that are not finite.

    Args:
        before: The states [B, D].
        controls: The controls [B, A].
        after: What they led to [B, D].

    Raises:
        CallbackFailed: names the first transition that gave a state with NaN or infinity.
    """
    if np.isfinite(after).all():
        return
    bad = int(np.argmin(np.isfinite(after).all(axis=1)))
    raise CallbackFailed(f"the environment returned the state {after[bad].tolist()} from state "
                         f"{before[bad].tolist()} with control {controls[bad].tolist()}; expected finite numbers")
