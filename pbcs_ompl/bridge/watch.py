"""What the callbacks of one problem tell each other and the termination condition."""

from math import isfinite

from pbcs_ompl.bridge.coverage import Trace
from pbcs_ompl.core.errors import CallbackFailed, PbcsError
from pbcs_ompl.core.types import Counter


class Watch:
    """The shared memory of a problem's callbacks.

    Python exceptions must not cross OMPL's C++ (a benchmark aborts on one), so the first is kept here, the
    termination condition stops the planner, and `raise_error` raises it again in Python.

    Attributes:
        counter: Where every transition is counted.
        trace: Where what the planner does is taken down; None when nobody asked.
        validity_checks: How many states OMPL asked about that the environment had not just produced.
        error: The first exception of a callback.
        refused: A propagation was asked for when nothing was left of the budget.
        reached: The state [D] that the environment produced last, which is therefore valid.
    """

    __slots__ = ("counter", "error", "reached", "refused", "trace", "validity_checks")

    def __init__(self, counter: Counter, trace: Trace | None = None):
        self.counter = counter
        self.trace = trace
        self.validity_checks = 0
        self.error: BaseException | None = None
        self.refused = False
        self.reached: list[float] | None = None

    @property
    def stopped(self) -> bool:
        """Whether the planner has to end."""
        return self.refused or self.error is not None or self.counter.left == 0

    def fail(self, error: BaseException) -> None:
        """Keep the first exception."""
        if self.error is None:
            self.error = error

    def raise_error(self) -> None:
        """Raise what a callback raised, if any did, and forget it.

        Raises:
            CallbackFailed: a callback raised; the exception is chained. Our own errors are raised as such.
            KeyboardInterrupt: the user interrupted inside a callback.
        """
        error, self.error = self.error, None  # kept, it would close a circle through OMPL that Python cannot see
        if error is None:
            return
        if isinstance(error, PbcsError) or not isinstance(error, Exception):
            raise error
        raise failure(error) from error


def failure(error: BaseException) -> CallbackFailed:
    """Return the one-line error for an exception of a user's code; chain it with `from`."""
    text = " ".join(str(error).split()) or "no message"
    return CallbackFailed(f"the environment or strategy raised {type(error).__name__}: {text}")


def check_finite(values: list[float], state: list[float], control: list[float]) -> None:
    """Refuse a next state that is not finite.

    Raises:
        CallbackFailed: `values` holds NaN or infinity.
    """
    if not all(map(isfinite, values)):
        raise CallbackFailed(f"the environment returned the state {values} from state {state} with control "
                             f"{control}; expected finite numbers")
