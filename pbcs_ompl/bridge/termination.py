"""When a planner has to end: budget, time, a failed callback, Ctrl-C."""

import time
from collections.abc import Callable
from typing import NamedTuple

from pbcs_ompl.bridge.improvement.allowance import Allowance
from pbcs_ompl.bridge.problem import CallbackState
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import AnytimePlanner
from pbcs_ompl.core.types import Counter, ProgressCallback

SECONDS_BETWEEN_REPORTS = 0.25


class Limits(NamedTuple):
    """How long a planner may search."""

    max_transitions: int
    max_seconds: float | None


def checked_limits(max_transitions: int, max_seconds: float | None) -> Limits:
    """Return the limits.

    Raises:
        InvalidOption: one of them is not above 0.
    """
    if max_transitions <= 0:
        raise InvalidOption(f"max_transitions is {max_transitions}; expected at least 1")
    if max_seconds is not None and not max_seconds > 0:
        raise InvalidOption(f"max_seconds is {max_seconds}; expected more than 0")
    return Limits(max_transitions, max_seconds)


def make_stop(callbacks: CallbackState, max_seconds: float | None,
              on_progress: ProgressCallback | None) -> Callable[[], bool]:
    """Return the function that a termination condition polls; its clock starts now.

    Use it as `ompl.base.PlannerTerminationCondition(stop)`: the form with a period polls from a thread of
    OMPL's that waits for Python's lock for ever.
    """
    began = time.monotonic()
    deadline = float("inf") if max_seconds is None else began + max_seconds
    due = float("inf") if on_progress is None else began

    def stop() -> bool:
        nonlocal due
        now = time.monotonic()
        if now >= due and on_progress is not None:
            due = now + SECONDS_BETWEEN_REPORTS
            try:
                on_progress({"transitions": callbacks.counter.count, "seconds": now - began})
            except BaseException as error:  # nothing may cross OMPL's C++
                callbacks.fail(error)
        return callbacks.stopped or now >= deadline

    return stop


def stop_after_first(stop: Callable[[], bool], planner: AnytimePlanner, counter: Counter,
                     allowance: Allowance) -> Callable[[], bool]:
    """Return `stop` that also ends a planner which continues after its first solution, once an allowance is used up.

    Args:
        stop: What ends it at the latest.
        planner: The planner.
        counter: Its transitions, whose budget is set once there is a solution.
        allowance: What it may use after its first solution.
    """
    deadline = float("inf")
    found = False

    def stop_continued() -> bool:
        nonlocal deadline, found
        if not found and planner.solutions:
            found, left = True, allowance.after(counter.count)
            if left.transitions is not None:
                most = counter.count + left.transitions
                counter.budget = most if counter.budget is None else min(counter.budget, most)
            if left.seconds is not None:
                deadline = time.monotonic() + left.seconds
        return stop() or time.monotonic() >= deadline

    return stop_continued
