"""The interfaces between the subpackages: a resettable environment, and what builds a planner.

States are complete: everything that is needed to restart the simulator.
"""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import gymnasium
import numpy as np

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, BoolArray, Capability, Counter, IndexArray, Solution, Transition


class ResettableModel(Protocol):
    """An environment seen as functions of states: what planners and skills work on.

    One adapter for each family of environments lies in `pbcs_ompl.resettable`.

    Attributes:
        env: The environment that is stepped; None where there is none.
        spec: What makes the same model again, in another process too.
        capabilities: "visited" states can be restored; "arbitrary" vectors within the bounds too; "exact" means
            that a restored state continues bit for bit.
        state_low, state_high: Bounds of the state [D], finite.
        action_low, action_high: Bounds of the action [A], finite.
        feature_low, feature_high: Bounds of the explored feature [F], finite.
        feature_dims: The state dimensions that are the feature, when it is a selection of them, else None.
        bin_size: Suggested edge length of exploration bins along each feature dimension [F].
        feature_periods: The period of each feature dimension, as 2 pi for an angle that turns freely; 0 for none [F].
        goal_threshold: A state is a success if and only if `goal_distance < goal_threshold`.
        max_episode_steps: Length of an episode: the limit, where there is one, else a suggestion.
        episode_limit: Steps after which the environment cuts an episode off; None where it has no limit.
        make_env: Makes a fresh environment, to verify in; None where that is not possible.
        parallel_batch: How many states `transition` has to be given together to keep all cores busy; 1 where it does
            not matter. It does not depend on the number of cores, so results do not either.
        walls: Rectangles [W, 4] (x0, y0, x1, y1) in the first two feature dimensions, for pictures; may be empty.
        goal_circle: Centre and radius (x, y, r) of the goal in the same plane, for pictures; None when unknown.
    """

    env: Any
    spec: EnvSpec
    capabilities: frozenset[Capability]
    state_low: Array
    state_high: Array
    action_low: Array
    action_high: Array
    feature_low: Array
    feature_high: Array
    feature_dims: tuple[int, ...] | None
    bin_size: Array
    feature_periods: Array
    observation_size: int
    goal_threshold: float
    max_episode_steps: int
    episode_limit: int | None
    make_env: Callable[[], gymnasium.Env[Any, Any]] | None
    parallel_batch: int
    walls: Array
    goal_circle: tuple[float, float, float] | None

    def initial_state(self, seed: int | None = None) -> Array:
        """Return the state [D] after `env.reset(seed=seed)`."""
        ...

    def transition(self, states: Array, controls: Array) -> Transition:
        """Advance states [B, D] by one step under controls [B, A]; fresh arrays are returned."""
        ...

    def step_one(self, state: list[float], control: list[float]) -> list[float]:
        """Advance one state, given and returned as a list of D floats: the fast path of a single propagation.

        Empty where the episode ends there and is no success; that state has no successors.
        """
        ...

    def observe(self, states: Array) -> Array:
        """Return the observations [B, O] a policy sees in states [B, D]."""
        ...

    def feature(self, states: Array) -> Array:
        """Return the features [B, F] of states [B, D]."""
        ...

    def goal_distance(self, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the environment's goal."""
        ...

    def is_valid(self, states: Array) -> BoolArray:
        """Return which states [B, D] the environment can be in (FCL decides where there are walls)."""
        ...

    def distance(self, states: Array, others: Array) -> Array:
        """Return the distances [B] between states [B, D] and others [B, D] or [D], as activation sets use them."""
        ...

    def perturb(self, state: Array, radius: float, count: int, rng: np.random.Generator, *,
                reject_invalid: bool = True, before: Array | None = None, rollout_steps: int = 5,
                counter: "Counter | None" = None) -> Array:
        """Draw `count` states [count, D] within `radius` of `state` [D]; invalid ones are drawn again.

        Where that takes steps of the environment, at most `rollout_steps` for each rollout, they begin in the states
        `before` [N, D] that lead to `state` as well, and are counted in `counter`.

        Raises:
            InvalidState: no valid state was found near `state`.
        """
        ...

    def advance_towards(self, states: Array, targets: Array) -> Array:
        """Return controls [B, A] that lead from states [B, D] towards targets [B, F].

        Raises:
            InvalidOption: the environment offers no steering.
        """
        ...


@runtime_checkable
class GetSetEnv(Protocol):
    """What an environment offers to be resettable in the simplest way (beside being a `gymnasium.Env`).

    Optional attributes: those of `resettable.attributes.EnvAttributes`.
    """

    def get_env_state(self) -> Array: ...
    def set_env_state(self, state: Array) -> None: ...


@runtime_checkable
class VectorisedEnv(Protocol):
    """What an environment offers to be resettable in the fastest way (beside being a `gymnasium.Env`).

    Optional attributes: those of `resettable.attributes.EnvAttributes`.
    """

    state_low: Array
    state_high: Array
    goal_threshold: float

    def get_env_state(self) -> Array: ...
    def set_env_state(self, state: Array) -> None: ...
    def transition(self, states: Array, controls: Array) -> Transition: ...
    def observe(self, states: Array) -> Array: ...
    def goal_distance(self, states: Array) -> Array: ...
    def is_valid(self, states: Array) -> BoolArray: ...


@runtime_checkable
class BatchPlanner(Protocol):
    """An OMPL planner that can propagate many states of a model together, and that keeps its tree and its error."""

    @property
    def tree(self) -> Tree | None:
        """The tree as arrays; None before `solve`."""
        ...

    @property
    def solution(self) -> IndexArray | None:
        """The nodes [T+1] of the tree from a root to the goal, one a step; None unless the last `solve` reached it."""
        ...

    @property
    def error(self) -> PbcsError | None:
        """What ended the last `solve` abnormally: exceptions must not cross OMPL."""
        ...

    @property
    def settings(self) -> dict[str, Any]:
        """Every option with its value."""
        ...

    def use_model(self, model: ResettableModel, counter: Counter) -> None:
        """Propagate through `model` from now on, and count every transition in `counter`."""
        ...


@runtime_checkable
class AnytimePlanner(BatchPlanner, Protocol):
    """A batch planner that says when it found which solutions; it may go on after the first one."""

    @property
    def solutions(self) -> list[Solution]:
        """When the last `solve` found a path shorter than all before, and its steps."""
        ...


@runtime_checkable
class PlannerFactory(Protocol):
    """What builds a planner and is not itself an `ompl.base.Planner` class."""

    def options(self) -> dict[str, Any]:
        """Return every option with its default; None where the planner decides."""
        ...

    def build(self, si: Any, *, seed: int, **options: Any) -> Any:
        """Return a new planner for the space information `si`."""
        ...
