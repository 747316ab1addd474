"""How a planner advances states: through the environment itself, or through OMPL's own propagator."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from ompl import control as oc

from pbcs_ompl.core.callbacks import check_finite
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption, Mismatch, UnsupportedSpace
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import path_control, real_bounds, real_dimension, value_reader, value_writer
from pbcs_ompl.core.tree import Tree, resized_copy
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray, Transition
from pbcs_ompl.planners.compiled import CompiledStep, step_of


@dataclass(frozen=True, eq=False)
class PlanningContext:
    """What a strategy may know of the problem.

    Attributes:
        feature_low, feature_high: Bounds of the explored feature [F]; infinite where there are none.
        bin_size: Suggested edge length of bins [F].
        action_low, action_high: Bounds of the controls [A].
        episode_steps: Suggested length of an episode.
        parallel_batch: How many nodes have to be expanded together to keep all cores busy; 1 where it does not matter.
        steer: Returns controls [B, A] that lead from states [B, D] towards features [B, F]; None where there is no
            steering.
    """

    feature_low: Array
    feature_high: Array
    bin_size: Array
    action_low: Array
    action_high: Array
    episode_steps: int = 1000
    parallel_batch: int = 1
    steer: Callable[[Array, Array], Array] | None = None

    def edge_lengths(self, name: str, given: Array | None) -> Array:
        """Return an edge length of bins for each feature [F].

        Args:
            name: The option that gives them.
            given: One for all or one for each feature; None for the suggested ones.

        Raises:
            InvalidOption: `given` has another number of edges.
        """
        features = len(self.bin_size)
        if given is None:
            return np.array(self.bin_size)
        if len(given) not in (1, features):
            raise InvalidOption(f"{name} has {len(given)} numbers; expected 1, or {features}")
        return np.array(np.broadcast_to(given, features))


class BatchPropagator(ABC):
    """What a TreePlanner needs of a problem, however its states are kept.

    Attributes:
        counter: Counts every transition.
        max_batch: The most nodes that are worth expanding together.
    """

    counter: Counter
    max_batch: int

    @abstractmethod
    def context(self) -> PlanningContext:
        """Describe the problem for a strategy."""

    @abstractmethod
    def new_tree(self) -> Tree:
        """Return an empty tree, and drop the states of the one before."""

    @abstractmethod
    def add_root(self, tree: Tree, state: Any, goal: Any) -> bool:
        """Add an OMPL start state; return whether it is in the goal."""

    @abstractmethod
    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, goal: Any) -> int:
        """Add what follows from nodes [B] under controls [B, A], up to the first in the goal.

        Args:
            tree: The tree, which grows.
            nodes: The nodes [B] to expand.
            controls: A control [B, A] for each.
            goal: The problem's `ompl.base.Goal`.

        Returns:
            The node in the goal, or -1.

        Raises:
            CallbackFailed: a state is not finite.
        """

    @abstractmethod
    def path(self, tree: Tree, nodes: IndexArray) -> Any:
        """Return the `ompl.control.PathControl` through nodes [T+1]."""

    @abstractmethod
    def state(self, tree: Tree, node: int) -> Any:
        """Return a node's OMPL state."""


class ModelPropagator(BatchPropagator):
    """Advances many states together in a resettable model: a control is one step, the model says what a success is.

    Attributes:
        compiled: The model's step for compiled loops, where it offers one and features are dimensions of the state.
        feature_dims: These dimensions.

    Args:
        si: The `ompl.control.SpaceInformation` of the same problem.
        model: The environment.
        counter: Counts every transition.

    Raises:
        Mismatch: the OMPL problem and the model differ in the size of states or controls.
        UnsupportedSpace: the OMPL problem is not made of real vectors.
    """

    max_batch = 1024

    def __init__(self, si: Any, model: ResettableModel, counter: Counter):
        self.counter = counter
        self._si = si
        self._model = model
        _check_size("states", si.getStateSpace(), len(model.state_low))
        _check_size("controls", si.getControlSpace(), len(model.action_low))
        self._read, self._write = value_reader(si.getStateSpace()), value_writer(si.getStateSpace())
        self.feature_dims = np.array(model.feature_dims or (), dtype=np.int64)
        self._limit = model.episode_limit
        self._depths = np.empty(0, np.int64)
        compilable = len(self.feature_dims) and self._limit is None
        self.compiled: CompiledStep | None = step_of(model) if compilable else None

    def context(self) -> PlanningContext:
        """Describe the environment for a strategy."""
        model = self._model
        return PlanningContext(model.feature_low, model.feature_high, model.bin_size, model.action_low,
                               model.action_high, model.max_episode_steps, model.parallel_batch,
                               model.advance_towards)

    def new_tree(self) -> Tree:
        """Return an empty tree of states [D] and features [F]."""
        model = self._model
        whole = model.feature_dims == tuple(range(len(model.state_low)))
        return Tree(len(model.state_low), len(model.action_low), None if whole else len(model.feature_low),
                    expected=0 if self.counter.budget is None else self.counter.left + 1)

    def add_root(self, tree: Tree, state: Any, goal: Any) -> bool:
        """Add an OMPL start state; return whether the model calls it a success."""
        states = np.array([self._read(state)])
        self._end_of_episode(tree, np.array([-1]))
        tree.append(states, -1, 0.0, 0.0, False, self._features(tree, states))
        return bool(self._model.goal_distance(states)[0] < self._model.goal_threshold)

    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, goal: Any) -> int:
        """Add what follows; transitions after the first success are neither kept nor counted.

        A node is terminal where the environment ends the episode, or where its limit of steps is reached.
        """
        before = tree.states[nodes]
        result = self._model.transition(before, controls)
        _check_shapes(result, before.shape)
        first_success = int(result.success.argmax())
        reached = bool(result.success[first_success])
        count = first_success + 1 if reached else len(nodes)
        after = result.states[:count]
        check_finite(before, controls, after)
        ended = result.ended[:count] | self._end_of_episode(tree, nodes[:count])
        tree.append(after, nodes[:count], controls[:count], result.rewards[:count], ended, self._features(tree, after))
        self.counter.count += count
        return len(tree) - 1 if reached else -1

    def path(self, tree: Tree, nodes: IndexArray) -> Any:
        """Return the PathControl through nodes [T+1], each control lasting one step."""
        return path_control(self._si, tree.states[nodes], tree.controls[nodes[1:]])

    def state(self, tree: Tree, node: int) -> Any:
        """Return a node's state as a new OMPL state."""
        state = self._si.allocState()
        self._write(state, tree.states[node].tolist())
        return state

    def _end_of_episode(self, tree: Tree, parents: IndexArray) -> BoolArray:
        """Return which children of nodes [B] are at the limit of an episode [B], and keep their depths."""
        if self._limit is None:
            return np.zeros(len(parents), np.bool_)
        first, last = len(tree), len(tree) + len(parents)
        if last > len(self._depths):
            self._depths = resized_copy(self._depths, min(first, len(self._depths)), 2 * last)
        self._depths[first:last] = np.where(parents < 0, 0, self._depths[parents] + 1)
        at_limit: BoolArray = self._depths[first:last] >= self._limit
        return at_limit

    def _features(self, tree: Tree, states: Array) -> Array | None:
        return None if tree.columns.features is tree.columns.states else self._model.feature(states)


class OmplPropagator(BatchPropagator):
    """Advances one state at a time of any `ompl.control.SpaceInformation`; for planners without an environment.

    The feature is the default projection, as for OMPL's KPIECE1 and EST. A control lasts a random number of steps
    within the problem's bounds and ends where the motion becomes invalid; the last state is kept if the control lasted
    the least number of steps, as OMPL's own planners do. In the tree, the states are the projections. Rewards are 0, no
    state is terminal, and the goal is the problem's.

    Args:
        si: The problem.
        rng: Draws the durations.

    Raises:
        UnsupportedSpace: no default projection, or controls that are not real vectors.
    """

    max_batch = 1

    def __init__(self, si: Any, rng: np.random.Generator):
        if not si.isSetup():
            si.setup()
        space = si.getStateSpace()
        if not space.hasDefaultProjection():
            raise UnsupportedSpace(f"the state space {space.getName()!r} has no default projection; "
                                   "register one with registerDefaultProjection")
        self.counter = Counter()
        self._si = si
        self._rng = rng
        self._projection = space.getDefaultProjection()
        self._point = np.empty(self._projection.getDimension())
        self._control_bounds = real_bounds(si.getControlSpace())
        self._write_control = value_writer(si.getControlSpace())
        self._control = si.allocControl()
        self._durations = (si.getMinControlDuration(), si.getMaxControlDuration())
        self._states: list[Any] = []
        self._steps: list[int] = []

    def context(self) -> PlanningContext:
        """Describe the projection and the controls for a strategy."""
        size = len(self._point)
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        if self._projection.hasBounds():
            box = self._projection.getBounds()
            low, high = np.array(box.low), np.array(box.high)
        return PlanningContext(low, high, np.array(self._projection.getCellSizes()), *self._control_bounds)

    def new_tree(self) -> Tree:
        """Return an empty tree of projections."""
        self._states, self._steps = [], []
        return Tree(len(self._point), len(self._control_bounds[0]))

    def add_root(self, tree: Tree, state: Any, goal: Any) -> bool:
        """Add a copy of a start state; return whether it is in the goal."""
        copy = self._si.allocState()
        self._si.copyState(copy, state)
        self._add(tree, copy, -1, 0, 0.0)
        return bool(goal.isSatisfied(copy))

    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, goal: Any) -> int:
        """Propagate each node; a motion that is invalid from the start adds nothing."""
        least, most = self._durations
        for node, control in zip(nodes.tolist(), controls, strict=True):
            self._write_control(self._control, control.tolist())
            steps = int(self._rng.integers(least, most + 1))
            state = self._si.allocState()
            lasted = self._si.propagateWhileValid(self._states[node], self._control, steps, state)
            self.counter.count += min(lasted + 1, steps)
            if lasted < max(1, least):
                continue
            if self._si.distance(state, state) != 0.0:  # NaN in any component is a distance that is not 0
                raise CallbackFailed("the propagator returned a state that is not finite, from the state "
                                     f"with projection {tree.states[node].tolist()} under control "
                                     f"{control.tolist()} during {lasted} steps")
            self._add(tree, state, node, lasted, control)
            if goal.isSatisfied(state):
                return len(tree) - 1
        return -1

    def path(self, tree: Tree, nodes: IndexArray) -> Any:
        """Return the PathControl through nodes [T+1]."""
        path = oc.PathControl(self._si)
        step_size = self._si.getPropagationStepSize()
        for node, child in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
            self._write_control(self._control, tree.controls[child].tolist())
            path.append(self._states[node], self._control, self._steps[child] * step_size)
        path.append(self._states[nodes[-1]])
        return path

    def state(self, tree: Tree, node: int) -> Any:
        """Return a node's state; it belongs to the propagator."""
        return self._states[node]

    def _add(self, tree: Tree, state: Any, parent: int, steps: int, control: Array | float) -> None:
        self._projection.project(state, self._point)
        if not np.isfinite(self._point).all():
            raise CallbackFailed(f"the projection of a state is {self._point.tolist()}, which is not finite")
        tree.append(self._point[None], parent, control, 0.0, False)
        self._states.append(state)
        self._steps.append(steps)


def _check_shapes(result: Transition, shape: tuple[int, ...]) -> None:
    for name, array in result._asdict().items():
        if array is None:
            continue
        expected = shape if name == "states" else shape[:1]
        if array.shape != expected:
            raise CallbackFailed(f"the environment's transition returned {name} of shape {array.shape}; "
                                 f"expected {expected}")


def _check_size(what: str, space: Any, expected: int) -> None:
    size = real_dimension(space)
    if size != expected:
        raise Mismatch(f"the OMPL problem has {what} of {size} dimensions, the environment of {expected}")
