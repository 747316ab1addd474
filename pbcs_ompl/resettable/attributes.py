"""The optional attributes of an environment: declared here, read here, and nowhere else."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from typing import Any, Self

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.robot import Robot
from pbcs_ompl.core.types import Array, BoolArray, Capability

REQUIRED = ("get_env_state", "set_env_state", "transition")
"""What an environment is recognised by; see `adapt`."""
SIMILAR = 0.85
"""From this similarity on (difflib's ratio) a name is taken for a misspelt one; MuJoCo's `set_state` has 0.82."""
LIBRARIES = ("builtins", "gymnasium", "gymnasium_robotics", "pettingzoo", "numpy", "pbcs_ompl", "typing", "abc")
"""Packages whose own attributes are not the user's spelling."""


def _optional(default: str, meaning: str) -> Any:
    return field(default=None, metadata={"default": default, "meaning": meaning})


@dataclass(frozen=True)
class EnvAttributes:
    """What an environment offers beside Gymnasium's interface; None for what it does not offer.

    Raises:
        InvalidOption: an attribute has another type than its name says.
    """

    state_low: Array | None = _optional("the observation space, where the state is the observation",
                                        "lower bounds of the state [D], finite: any valid vector can be restored")
    state_high: Array | None = _optional("as `state_low`", "upper bounds of the state [D]")
    capabilities: frozenset[Capability] | None = _optional("what the bounds suggest",
                                                           'a set of "visited", "arbitrary", "exact"')
    observe: Callable[[Array], Array] | None = _optional("what was seen is kept",
                                                         "observations [B, O] of states [B, D]")
    is_valid: Callable[[Array], BoolArray] | None = _optional("within the bounds", "which states [B, D] are valid [B]")
    goal_distance: Callable[[Array], Array] | None = _optional('`info["is_success"]`',
                                                               "distances [B] of states [B, D] to the goal")
    goal_threshold: float | None = _optional("goes with `goal_distance`", "a success is a smaller distance")
    feature_dims: tuple[int, ...] | None = _optional("all", "the dimensions of the state that are explored")
    bin_size: Array | None = _optional("extent / 20", "edge length of exploration bins, one or [F]")
    feature_periods: Array | None = _optional(
        "none", "the period of each feature [F], as 2 pi for an angle that turns freely; 0 for one without")
    max_episode_steps: int | None = _optional("as registered, else 1000", "length of an episode")
    parallel_batch: int | None = _optional("1", "how many states keep all cores busy in one `transition`")
    distance: Callable[[Array, Array], Array] | None = _optional(
        "Euclidean", "distances [B] between states [B, D] and others, for activation sets")
    perturb: Callable[[Array, float, int, np.random.Generator], Array] | None = _optional(
        "uniform in the ball", "`perturb(state, radius, count, rng)`: states [count, D] near a state")
    perturb_by_rollouts: bool | None = _optional(
        "False", "whether states near a state are those that short random rollouts reach")
    advance_towards: Callable[[Array, Array], Array] | None = _optional(
        "no steering", "controls [B, A] from states [B, D] towards features [B, F]")
    step_one: Callable[[list[float], list[float]], list[float]] | None = _optional(
        "`transition` of one", "the next state of one state, as lists of floats, empty where an episode ends without "
        "success; of vectorised environments")
    compiled_step: Callable[[], Any] | None = _optional(
        "none", "the step for compiled planners, of vectorised environments; see docs/planners.md")
    walls: Array | None = _optional("none", "rectangles [W, 4] (x0, y0, x1, y1), for pictures")
    goal_circle: tuple[float, float, float] | None = _optional("none", "centre and radius (x, y, r), for pictures")
    robot: Robot | None = _optional(
        "none", "what moves in the plane with which the feature begins: heading, symmetries, falls, whether the "
                "heading counts on lines (`turning`), a `pbcs_ompl.core.robot.Robot`")

    def __post_init__(self) -> None:
        for name in FUNCTIONS:
            value = vars(self)[name]
            _require(name, value, value is None or callable(value), "a function")
        for name in ("max_episode_steps", "parallel_batch"):
            value = vars(self)[name]
            whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
            _require(name, value, value is None or (whole and value >= 1), "a positive integer")
        for name in ("state_low", "state_high", "bin_size", "feature_periods", "walls", "goal_circle",
                     "feature_dims"):
            value = vars(self)[name]
            _require(name, value, value is None or np.asarray(value).dtype.kind in "iuf", "numbers")
        threshold = self.goal_threshold
        _require("goal_threshold", threshold, threshold is None or np.ndim(threshold) == 0, "a number")

    @property
    def restores(self) -> frozenset[Capability]:
        """The capabilities: those that are offered, else any vector within bounds that are."""
        usual: set[Capability] = {"visited", "exact"}
        if self.state_low is not None:
            usual.add("arbitrary")
        return frozenset(usual if self.capabilities is None else self.capabilities)

    @classmethod
    def of(cls, env: Any) -> Self:
        """Return the attributes that an environment offers."""
        return cls(**{name: getattr(env, name, None) for name in NAMES})


FUNCTIONS = ("observe", "is_valid", "goal_distance", "distance", "perturb", "advance_towards", "step_one",
             "compiled_step")
NAMES = tuple(declared.name for declared in fields(EnvAttributes))


def misspelt(env: Any) -> dict[str, str]:
    """Return the attributes of an environment that look like misspelt ones of ours, with the name that is meant.

    Attributes of libraries, and those that begin with an underscore, are not looked at; nor are names close to one that
    the environment offers as well.
    """
    own = {name for kind in type(env).__mro__ if kind.__module__.partition(".")[0] not in LIBRARIES
           for name in vars(kind)}
    if own:
        own |= set(vars(env))
    absent = [name for name in (*NAMES, *REQUIRED) if getattr(env, name, None) is None]
    found = {}
    for name in sorted(own):
        if not name.startswith("_") and name not in (*NAMES, *REQUIRED):
            function = callable(getattr(env, name, None))
            alike = [known for known in absent if function == (known in (*FUNCTIONS, *REQUIRED))]
            close = get_close_matches(name.lower(), alike, n=1, cutoff=SIMILAR)
            if close:
                found[name] = close[0]
    return found


def _require(name: str, value: Any, holds: Any, expected: str) -> None:
    if not holds:
        raise InvalidOption(f"the environment's {name} is {value!r}; expected {expected}")
