"""How a planner advances states, and how through the environment itself."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from pbcs_ompl.core.callbacks import check_finite
from pbcs_ompl.core.errors import CallbackFailed, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import path_control, real_dimension, value_reader, value_writer
from pbcs_ompl.core.tree import Tree, resized_copy
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray, Transition
from pbcs_ompl.planners.compiled import CompiledStep, step_of
from pbcs_ompl.planners.context import PlanningContext


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
    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, durations: IndexArray, goal: Any) -> int:
        """Add what follows from nodes [B] under controls [B, A], up to the first in the goal.

        Args:
            tree: The tree, which grows.
            nodes: The nodes [B] to expand.
            controls: A control [B, A] for each.
            durations: For how many steps each is applied [B].
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
    """Advances many states together in a resettable model: every step is a node, the model says what a success is.

    Attributes:
        compiled: The model's step for compiled loops, where it offers one and features are dimensions of the state.
        feature_dims: These dimensions.

    Args:
        si: The `ompl.control.SpaceInformation` of the same problem.
        model: The environment.
        counter: Counts every transition.
        durations: The least and the most steps that a control lasts.

    Raises:
        Mismatch: the OMPL problem and the model differ in the size of states or controls.
        UnsupportedSpace: the OMPL problem is not made of real vectors.
    """

    max_batch = 1024

    def __init__(self, si: Any, model: ResettableModel, counter: Counter, durations: tuple[int, int] = (1, 1)):
        self.counter = counter
        self._si = si
        self._model = model
        self._durations = durations
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
                               model.advance_towards, self._durations, model.feature_periods)

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

    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, durations: IndexArray, goal: Any) -> int:
        """Add what follows, first the first step of every control; what comes after the first success is not kept.

        A node is terminal where the environment ends the episode, or where its limit of steps is reached.
        """
        if self.compiled is not None:
            return self._expand_compiled(self.compiled, tree, nodes, controls, durations)
        first, taken, reached = len(tree), 1, self._step(tree, nodes, controls)
        while reached < 0:
            children = np.arange(first, len(tree))
            going = np.flatnonzero((durations > taken) & ~tree.terminal[children])[:self.counter.left]
            if not len(going):
                break
            nodes, controls, durations, first = children[going], controls[going], durations[going], len(tree)
            taken, reached = taken + 1, self._step(tree, nodes, controls)
        return reached

    def _expand_compiled(self, compiled: CompiledStep, tree: Tree, nodes: IndexArray, controls: Array,
                         durations: IndexArray) -> int:
        from pbcs_ompl.planners.kernels import batch_loop  # compiled when it is imported, and rarely used

        first, most = len(tree), min(self.counter.left, int(durations.sum()))
        tree.reserve(most)
        written, reached = batch_loop.expand(compiled.parameters, self.feature_dims, tree.columns, first, most,
                                             nodes, controls, durations)
        tree.claim(written)
        self.counter.count += written
        check_finite(tree.states[tree.parents[-1:]], tree.controls[-1:], tree.states[-1:])
        return len(tree) - 1 if reached else -1

    def _step(self, tree: Tree, nodes: IndexArray, controls: Array) -> int:
        """Add what follows from nodes [B] after one step; return the node in the goal, or -1."""
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
        """Return the PathControl through nodes [T+1]; a control that is held is one, with the states at its ends.

        OMPL copies each state, which would take a fifth of the time of a search by Rides.
        """
        controls = tree.controls[nodes[1:]]
        changes = np.flatnonzero((controls[1:] != controls[:-1]).any(axis=1)) + 1
        ends = np.concatenate([[0], changes, [len(controls)]]) if len(controls) else np.zeros(1, np.int64)
        return path_control(self._si, tree.states[nodes[ends]], controls[ends[:-1]], np.diff(ends))

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
