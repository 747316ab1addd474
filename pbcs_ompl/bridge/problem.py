"""An environment as an OMPL control problem."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from ompl import control as oc
from ompl import util as ou

from pbcs_ompl.bridge.coverage import Trace
from pbcs_ompl.bridge.goal import EnvironmentGoal
from pbcs_ompl.bridge.layout import blocks, state_writer
from pbcs_ompl.bridge.propagator import make_propagator
from pbcs_ompl.bridge.spaces import make_control_space, make_state_space
from pbcs_ompl.bridge.validity import make_validity
from pbcs_ompl.bridge.watch import Watch
from pbcs_ompl.core.errors import InvalidOption, InvalidState, UnsupportedSpace
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, Counter


class Problem:
    """An `ompl.control.SimpleSetup` around an environment. Close it, or use it in a `with`, when done.

    Attributes:
        setup: The SimpleSetup: spaces, propagator, validity, start and goal; it lacks only a planner.
        model: The environment.
        start: The start state [D].
        watch: The transitions counted, and the first exception of a callback.
    """

    def __init__(self, setup: Any, model: ResettableModel, start: Array, watch: Watch):
        self.setup = setup
        self.model = model
        self.start = start
        self.watch = watch

    @property
    def space_information(self) -> Any:
        """The `ompl.control.SpaceInformation` that planners are built on."""
        return self.setup.getSpaceInformation()

    def __enter__(self) -> "Problem":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Take the callbacks out of OMPL, so that nothing holds the environment any longer."""
        self.setup.setStatePropagator(_stand_still)
        self.setup.setStateValidityChecker(_never)


def make_problem(model: ResettableModel, *, counter: Counter, start: Array | None = None, seed: int = 0,
                 trace: Trace | None = None) -> Problem:
    """Build the control problem of an environment: one control is one step, and costs one transition.

    OMPL's random numbers are seeded before anything is built, so equal seeds give equal paths, in this
    process as in a fresh one.

    Args:
        model: The environment.
        counter: Counts the transitions against a budget.
        start: The start state [D]; by default the environment's own for `seed`.
        seed: The seed of OMPL's planners and samplers, and of the environment's reset.
        trace: Takes down the states that the propagator produces, if anybody wants to know.

    Raises:
        InvalidState: the start is not finite, outside the bounds or inside a wall.
        UnsupportedSpace: the bounds of the environment are not finite.
    """
    _check_model(model)
    begin = _check_start(model, model.initial_state(seed) if start is None else start)
    with quiet_ompl():
        seed_ompl(seed)
        state_space = make_state_space(model)
        setup = oc.SimpleSetup(make_control_space(state_space, model))
        information = setup.getSpaceInformation()
        watch = Watch(counter, trace)
        information.setPropagationStepSize(1.0)
        information.setMinMaxControlDuration(1, 1)
        setup.setStatePropagator(make_propagator(model, watch))
        setup.setStateValidityChecker(make_validity(model, watch))
        state = information.allocState()
        state_writer(blocks(len(begin), model.feature_dims))(state, begin.tolist())
        setup.addStartState(state)
        setup.setGoal(EnvironmentGoal(information, model, watch))
        information.setup()  # before this, asking OMPL's projection of a subspace anything is a crash
    return Problem(setup, model, begin, watch)


def seed_ompl(seed: int) -> None:
    """Seed OMPL's random numbers for everything that is built from now on.

    OMPL claims that this comes too late in a process that has drawn numbers before. It does not, as long as
    every OMPL object is built afterwards; a test holds OMPL to it. OMPL ignores the seed 0, hence the seed
    tree.
    """
    ou.RNG.setSeed(SeedTree(seed).child("ompl").integer())


@contextmanager
def quiet_ompl() -> Iterator[None]:
    """Keep OMPL from writing on stdout."""
    level = ou.getLogLevel()
    ou.setLogLevel(ou.LOG_NONE)
    try:
        yield
    finally:
        ou.setLogLevel(level)


def _check_model(model: ResettableModel) -> None:
    for name in ("state_low", "state_high", "action_low", "action_high"):
        bounds = getattr(model, name)
        if not np.all(np.isfinite(bounds)):
            raise UnsupportedSpace(f"{name} of {model.spec.id} is {bounds}; OMPL needs finite bounds")
    if not model.goal_threshold > 0:
        raise InvalidOption(f"goal_threshold of {model.spec.id} is {model.goal_threshold}; expected > 0")


def _check_start(model: ResettableModel, start: Array) -> Array:
    begin = np.array(start, dtype=np.float64)
    if begin.shape != model.state_low.shape:
        raise InvalidState(f"the start has shape {begin.shape}; expected {model.state_low.shape}")
    if not np.all(np.isfinite(begin)):
        raise InvalidState(f"the start {begin.tolist()} is not finite")
    outside = (begin < model.state_low) | (begin > model.state_high)
    if outside.any():
        dim = int(np.argmax(outside))
        raise InvalidState(f"the start has {begin[dim]} in dimension {dim}; expected between "
                           f"{model.state_low[dim]} and {model.state_high[dim]}")
    if not model.is_valid(begin[None])[0]:
        raise InvalidState(f"the start {begin.tolist()} is inside a wall of {model.spec.id}, or not valid")
    return begin


def _stand_still(state: Any, control: Any, duration: float, result: Any) -> None:
    """Propagate nothing, for a closed problem."""


def _never(state: Any) -> bool:
    return False
