"""What a user's callbacks may return or raise: finite states, and exceptions that become one named error."""

import numpy as np

from pbcs_ompl.core.errors import CallbackFailed
from pbcs_ompl.core.types import Array


def callback_failed(error: BaseException, source: str = "the environment, goal or planner") -> CallbackFailed:
    """Return the one-line error for an exception of a user's code; raise it `from` that exception."""
    text = " ".join(str(error).split()) or "no message"
    return CallbackFailed(f"{source} raised {type(error).__name__}: {text}")


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
