"""The batch door: a problem of the bridge, whose environment advances many states together."""

from typing import Any

import numpy as np
from ompl import control as oc

from pbcs_ompl.core.errors import CallbackFailed, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter, IndexArray, Transition
from pbcs_ompl.planners.compiled import CompiledStep, step_of
from pbcs_ompl.planners.door import Door
from pbcs_ompl.planners.real_values import leaves, read, writer
from pbcs_ompl.planners.strategy import Space
from pbcs_ompl.planners.tree import Tree


class ModelDoor(Door):
    """States are vectors, a control is one step, and success is what the environment says it is.

    Attributes:
        compiled: The environment's step for compiled loops, where it offers one and features are dimensions
            of the state.
        feature_dims: These dimensions.

    Raises:
        Mismatch: the OMPL problem and the environment differ in the size of states or controls.
        UnsupportedSpace: the OMPL problem is not made of real vectors.
    """

    widest_batch = 1024

    def __init__(self, si: Any, model: ResettableModel, counter: Counter):
        self.counter = counter
        self._si = si
        self._model = model
        self._states = leaves(si.getStateSpace())
        controls = leaves(si.getControlSpace())
        self._write_state, self._write_control = writer(self._states), writer(controls)
        _check_size("states", self._states, len(model.state_low))
        _check_size("controls", controls, len(model.action_low))
        self.feature_dims = np.array(model.feature_dims or (), dtype=np.int64)
        self.compiled: CompiledStep | None = step_of(model) if len(self.feature_dims) else None

    def space(self) -> Space:
        """Describe the environment for a strategy."""
        model = self._model
        return Space(model.feature_low, model.feature_high, model.bin_size, model.action_low,
                     model.action_high, model.max_episode_steps, model.parallel_batch, model.advance_towards)

    def new_tree(self) -> Tree:
        """Return an empty tree of states [D] and features [F]."""
        model = self._model
        whole = model.feature_dims == tuple(range(len(model.state_low)))
        return Tree(len(model.state_low), len(model.action_low), None if whole else len(model.feature_low),
                    expected=0 if self.counter.budget is None else self.counter.left + 1)

    def add_root(self, tree: Tree, state: Any, goal: Any) -> bool:
        """Add an OMPL start state; return whether the environment calls it a success."""
        states = np.array([read(self._states, state)])
        tree.append(states, -1, 0.0, 0.0, False, self._features(tree, states))
        return bool(self._model.goal_distance(states)[0] < self._model.goal_threshold)

    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, goal: Any) -> int:
        """Add what follows; transitions after the first success are neither kept nor counted."""
        before = tree.states[nodes]
        result = self._model.transition(before, controls)
        _check_shapes(result, before.shape)
        first_success = int(result.success.argmax())
        reached = bool(result.success[first_success])
        count = first_success + 1 if reached else len(nodes)
        after = result.states[:count]
        check_finite(before, controls, after)
        tree.append(after, nodes[:count], controls[:count], result.rewards[:count], result.terminated[:count],
                    self._features(tree, after))
        self.counter.count += count
        return len(tree) - 1 if reached else -1

    def path(self, tree: Tree, nodes: IndexArray) -> Any:
        """Return the PathControl through nodes [T + 1], each control held for one step."""
        path = oc.PathControl(self._si)
        state, control = self._si.allocState(), self._si.allocControl()
        duration = self._si.getPropagationStepSize()
        states, controls = tree.states[nodes].tolist(), tree.controls[nodes].tolist()
        for values, action in zip(states[:-1], controls[1:], strict=True):
            self._write_state(state, values)
            self._write_control(control, action)
            path.append(state, control, duration)
        self._write_state(state, states[-1])
        path.append(state)
        return path

    def state(self, tree: Tree, node: int) -> Any:
        """Return a node's state as a new OMPL state."""
        state = self._si.allocState()
        self._write_state(state, tree.states[node].tolist())
        return state

    def _features(self, tree: Tree, states: Array) -> Array | None:
        return None if tree.columns.features is tree.columns.states else self._model.feature(states)


def check_finite(before: Array, controls: Array, after: Array) -> None:
    """Refuse states [B, D] that are not finite.

    Raises:
        CallbackFailed: names the first transition that gave one.
    """
    if np.isfinite(after).all():
        return
    bad = int(np.argmin(np.isfinite(after).all(axis=1)))
    raise CallbackFailed(f"the environment returned the state {after[bad].tolist()} from state "
                         f"{before[bad].tolist()} with control {controls[bad].tolist()}; "
                         "expected finite numbers")


def _check_shapes(result: Transition, shape: tuple[int, ...]) -> None:
    for name, array in result._asdict().items():
        expected = shape if name == "states" else shape[:1]
        if array.shape != expected:
            raise CallbackFailed(f"the environment's transition returned {name} of shape {array.shape}; "
                                 f"expected {expected}")


def _check_size(what: str, parts: list[Any], expected: int) -> None:
    size = sum(leaf.space.getDimension() for leaf in parts)
    if size != expected:
        raise Mismatch(f"the OMPL problem has {what} of {size} dimensions, the environment of {expected}")
