"""OMPL's propagate as one step of the environment."""

from collections.abc import Callable
from typing import Any

from pbcs_ompl.bridge.layout import blocks, control_reader, state_reader, state_writer
from pbcs_ompl.bridge.watch import Watch, check_finite
from pbcs_ompl.core.interfaces import ResettableModel

Propagator = Callable[[Any, Any, float, Any], None]


def make_propagator(model: ResettableModel, watch: Watch) -> Propagator:
    """Return the callback propagate(state, control, duration, result) that makes one step of the environment.

    OMPL calls it once for every step of a control's duration, with `result` being `state` from the second
    step on: everything is read before anything is written. Every step is counted in `watch.counter`. When a
    step raises or is not finite, or the budget is used up, the result is a copy of the state and the watch
    says why.

    The function must not refer to any OMPL object: OMPL holds it, and such a cycle would never be freed.
    """
    step = model.step_one if watch.trace is None else watch.trace.recording(model.step_one)
    read, write = state_reader(parts := blocks(len(model.state_low), model.feature_dims)), state_writer(parts)
    read_control = control_reader(len(model.action_low))
    counter = watch.counter
    budget = float("inf") if counter.budget is None else counter.budget

    def propagate(state: Any, control: Any, duration: float, result: Any) -> None:
        values = read(state)
        try:
            if counter.count >= budget or watch.error is not None:
                watch.refused = True
                write(result, values)
                return
            counter.count += 1
            controls = read_control(control)
            reached = step(values, controls)
            total = sum(reached)
            if total - total != 0.0:  # NaN or infinite; the exact check is too slow for every step
                check_finite(reached, values, controls)
            write(result, reached)
            watch.reached = reached
        except BaseException as error:  # nothing may cross OMPL's C++; `Watch.raise_error` raises it
            watch.fail(error)
            write(result, values)

    return propagate
