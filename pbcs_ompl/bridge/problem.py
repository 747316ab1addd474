"""An environment as an OMPL control problem: propagator, validity and goal, and the state that they share.

OMPL calls the three while it plans. None of them refers to an OMPL object: OMPL holds the callbacks, and such a cycle
would never be freed. No exception leaves them: OMPL's C++ cannot pass it on, so `CallbackState` keeps it.
"""

from collections.abc import Callable
from math import inf, isnan, nan
from typing import Any, Self

import numpy as np
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.bridge.coverage import TransitionRecorder
from pbcs_ompl.bridge.spaces import make_control_space, make_state_space
from pbcs_ompl.core.callbacks import callback_failed, check_finite, code_of_others
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption, InvalidState, PbcsError, UnsupportedSpace
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import Reader, Writer, quiet_ompl, seed_ompl, value_reader, value_writer
from pbcs_ompl.core.types import Array, Counter


class CallbackState:
    """What the callbacks of one problem share with each other and with the termination condition.

    The first exception of a callback is kept here, the termination condition stops the planner, and `raise_error`
    raises it again in Python.

    Attributes:
        counter: Counts every transition.
        recorder: Records what the planner does; None unless asked for.
        validity_checks: How many states OMPL asked about that the environment had not just produced.
        error: The first exception of a callback.
        refused: A propagation was asked for when nothing was left of the budget.
        reached: The state [D] that the environment produced last, which is therefore valid; None where it ended an
            episode.
    """

    __slots__ = ("counter", "error", "reached", "recorder", "refused", "validity_checks")

    def __init__(self, counter: Counter, recorder: TransitionRecorder | None = None):
        self.counter = counter
        self.recorder = recorder
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
        """Raise what a callback raised, if any did, and drop it.

        Raises:
            CallbackFailed: a callback raised; the exception is chained. Our own errors are raised as such.
            KeyboardInterrupt: the user interrupted inside a callback.
        """
        error, self.error = self.error, None  # kept, it would close a cycle through OMPL that Python cannot see
        if error is None:
            return
        if isinstance(error, PbcsError) or not isinstance(error, Exception):
            raise error
        raise callback_failed(error) from error


def make_propagator(model: ResettableModel, callbacks: CallbackState, read: Reader, write: Writer,
                    read_control: Reader) -> Callable[[Any, Any, float, Any], None]:
    """Return the callback propagate(state, control, duration, result) that makes one step of the environment.

    OMPL calls it once for every step of a control's duration, with `result` being `state` from the second step on:
    everything is read before anything is written. Every step is counted. Where the environment ends the episode without
    success the result is NaN, which is not valid. When a step raises or is not finite, or the
    budget is used up, the result is a copy of the state and `callbacks` has the reason.

    Args:
        model: The environment.
        callbacks: What the callbacks share.
        read, write, read_control: Access to the states and controls of the problem's spaces.
    """
    recorder, counter = callbacks.recorder, callbacks.counter
    step = model.step_one if recorder is None else recorder.recording(model.step_one)
    budget = inf if counter.budget is None else counter.budget

    def propagate(state: Any, control: Any, duration: float, result: Any) -> None:
        values = read(state)
        try:
            if counter.count >= budget or callbacks.error is not None:
                callbacks.refused = True
                write(result, values)
                return
            counter.count += 1
            controls = read_control(control)
            reached = step(values, controls)
            if reached == []:  # the episode is over
                callbacks.reached = None
                write(result, [nan] * len(values))
                return
            total = sum(reached)
            if total - total != 0.0:  # NaN or infinite; the exact check is too slow for every step
                check_finite(np.array([values]), np.array([controls]), np.array([reached]))
            write(result, reached)
            callbacks.reached = reached
        except BaseException as error:
            callbacks.fail(error)
            write(result, values)

    return propagate


def make_validity(model: ResettableModel, callbacks: CallbackState, read: Reader) -> Callable[[Any], bool]:
    """Return the callback is_valid(state): in the bounds, and `model.is_valid` (FCL where there are walls).

    A state that the propagator has just produced is one the environment is in; it is not tested again, so stock
    planners pay for collision checks only on states they made up (as EST does when it samples near a state). Once the
    problem has stopped no propagated state is valid, so planners do not grow from a refused step.

    Args:
        model: The environment.
        callbacks: What the callbacks share.
        read: Access to the states of the problem's space.
    """
    low, high = model.state_low.tolist(), model.state_high.tolist()

    def is_valid(state: Any) -> bool:
        try:
            if callbacks.refused or callbacks.error is not None:
                return False
            values = read(state)
            if values == callbacks.reached:
                return True
            for value, least, most in zip(values, low, high, strict=True):
                if not least <= value <= most:
                    return False
            callbacks.validity_checks += 1
            return bool(model.is_valid(np.array([values]))[0])
        except BaseException as error:
            callbacks.fail(error)
            return False

    return is_valid


class EnvironmentGoal(ob.GoalRegion):  # type: ignore[misc] # OMPL's classes have no types
    """The states whose `model.goal_distance` is below (strictly) `model.goal_threshold`.

    The region cannot be sampled, so no planner can steer towards it: all explore without goal bias, as in
    [Matheron2020] ch. 3, whatever bias they are set to.

    Args:
        space_information: The `ompl.control.SpaceInformation` of the problem.
        model: The environment.
        callbacks: What the callbacks share.
    """

    def __init__(self, space_information: Any, model: ResettableModel, callbacks: CallbackState):
        super().__init__(space_information)
        self.setThreshold(float(model.goal_threshold))
        self._read = value_reader(space_information.getStateSpace())
        self._distance = model.goal_distance
        self._state = np.empty((1, len(model.state_low)))
        self._callbacks = callbacks

    def distanceGoal(self, state: Any) -> float:
        """Return the distance from `state` to the goal; infinite once a callback has failed."""
        callbacks = self._callbacks
        try:
            if callbacks.error is not None:
                return inf
            self._state[0] = self._read(state)
            distance = float(self._distance(self._state)[0])
            if isnan(distance):
                raise CallbackFailed(f"the goal distance of state {self._state[0].tolist()} is NaN")
            return distance
        except BaseException as error:
            callbacks.fail(error)
            return inf


class Problem:
    """An `ompl.control.SimpleSetup` around an environment. Close it, or use it in a `with`, when done.

    Attributes:
        setup: The SimpleSetup: spaces, propagator, validity, start and goal; it lacks only a planner.
        model: The environment.
        start: The start state [D].
        callbacks: The transitions counted, and the first exception of a callback.
    """

    def __init__(self, setup: Any, model: ResettableModel, start: Array, callbacks: CallbackState):
        self.setup = setup
        self.model = model
        self.start = start
        self.callbacks = callbacks

    @property
    def space_information(self) -> Any:
        """The `ompl.control.SpaceInformation` that planners are built on."""
        return self.setup.getSpaceInformation()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the callbacks from OMPL, so that it no longer keeps the environment alive."""
        self.setup.setStatePropagator(_stand_still)
        self.setup.setStateValidityChecker(_never)


def make_problem(model: ResettableModel, *, counter: Counter, start: Array | None = None, seed: int = 0,
                 recorder: TransitionRecorder | None = None) -> Problem:
    """Build the control problem of an environment: one control is one step, and costs one transition.

    OMPL's random numbers are seeded before anything is built, so equal seeds give equal paths, in this
    process as in a fresh one.

    Args:
        model: The environment.
        counter: Counts the transitions against a budget.
        start: The start state [D]; by default the environment's own for `seed`.
        seed: The seed of OMPL's planners and samplers, and of the environment's reset.
        recorder: Records the states that the propagator produces.

    Raises:
        InvalidState: the start is not finite, outside the bounds or inside a wall.
        UnsupportedSpace: the bounds of the environment are not finite.
    """
    _check_model(model)
    with code_of_others(f"the environment {model.spec.id!r}"):
        first = _check_start(model, model.initial_state(seed) if start is None else start)
    with quiet_ompl():
        seed_ompl(seed)
        state_space = make_state_space(model)
        setup = oc.SimpleSetup(make_control_space(state_space, model))
        information = setup.getSpaceInformation()
        callbacks = CallbackState(counter, recorder)
        information.setPropagationStepSize(1.0)
        information.setMinMaxControlDuration(1, 1)
        read, write = value_reader(state_space), value_writer(state_space)
        read_control = value_reader(information.getControlSpace())
        setup.setStatePropagator(make_propagator(model, callbacks, read, write, read_control))
        setup.setStateValidityChecker(make_validity(model, callbacks, read))
        state = information.allocState()
        write(state, first.tolist())
        setup.addStartState(state)
        setup.setGoal(EnvironmentGoal(information, model, callbacks))
        information.setup()  # before this, asking OMPL's projection of a subspace anything is a crash
    return Problem(setup, model, first, callbacks)


def _check_model(model: ResettableModel) -> None:
    for name, bounds in (("state_low", model.state_low), ("state_high", model.state_high),
                         ("action_low", model.action_low), ("action_high", model.action_high)):
        if not np.all(np.isfinite(bounds)):
            raise UnsupportedSpace(f"{name} of {model.spec.id} is {bounds}; OMPL needs finite bounds")
    if not model.goal_threshold > 0:
        raise InvalidOption(f"goal_threshold of {model.spec.id} is {model.goal_threshold}; expected > 0")


def _check_start(model: ResettableModel, start: Array) -> Array:
    first = np.array(start, dtype=np.float64)
    if first.shape != model.state_low.shape:
        raise InvalidState(f"the start has shape {first.shape}; expected {model.state_low.shape}")
    if not np.all(np.isfinite(first)):
        raise InvalidState(f"the start {first.tolist()} is not finite")
    outside = (first < model.state_low) | (first > model.state_high)
    if outside.any():
        dim = int(np.argmax(outside))
        raise InvalidState(f"the start has {first[dim]} in dimension {dim}; expected between "
                           f"{model.state_low[dim]} and {model.state_high[dim]}")
    if not model.is_valid(first[None])[0]:
        raise InvalidState(f"the start {first.tolist()} is inside a wall of {model.spec.id}, or not valid")
    return first


def _stand_still(state: Any, control: Any, duration: float, result: Any) -> None:
    """Propagate nothing, for a closed problem."""


def _never(state: Any) -> bool:
    return False
