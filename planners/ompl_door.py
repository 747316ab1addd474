"""The plain door: any `ompl.control.SpaceInformation`, one state at a time, through OMPL's own propagator."""

from typing import Any

import numpy as np
from ompl import control as oc

from pbcs_ompl.core.errors import CallbackFailed, UnsupportedSpace
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.planners.door import Door
from pbcs_ompl.planners.real_values import bounds, leaves, writer
from pbcs_ompl.planners.strategy import Space
from pbcs_ompl.planners.tree import Tree


class OmplDoor(Door):
    """States are OMPL's, of any space; the feature is the default projection, as for OMPL's KPIECE1 and EST.

    A control is held for a random number of steps within the problem's bounds and cut short where the motion
    becomes invalid; the end is kept if it was held for the least number of steps, as OMPL's own planners do.
    In the tree, the states are the projections. Rewards are 0, no state is terminal, and the goal is the
    problem's.

    Raises:
        UnsupportedSpace: no default projection, or controls that are not real vectors.
    """

    widest_batch = 1

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
        self._controls = leaves(si.getControlSpace())
        self._write_control = writer(self._controls)
        self._control = si.allocControl()
        self._durations = (si.getMinControlDuration(), si.getMaxControlDuration())
        self._states: list[Any] = []
        self._steps: list[int] = []

    def space(self) -> Space:
        """Describe the projection and the controls for a strategy."""
        size = len(self._point)
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        if self._projection.hasBounds():
            box = self._projection.getBounds()
            low, high = np.array(box.low), np.array(box.high)
        action_low, action_high = bounds(self._controls)
        cells = np.array(self._projection.getCellSizes())
        return Space(low, high, cells, np.array(action_low), np.array(action_high))

    def new_tree(self) -> Tree:
        """Return an empty tree of projections."""
        self._states, self._steps = [], []
        return Tree(len(self._point), sum(leaf.space.getDimension() for leaf in self._controls))

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
            held = self._si.propagateWhileValid(self._states[node], self._control, steps, state)
            self.counter.count += min(held + 1, steps)
            if held < max(1, least):
                continue
            if self._si.distance(state, state) != 0.0:  # NaN in any component is a distance that is not 0
                raise CallbackFailed("the propagator returned a state that is not finite, from the state "
                                     f"with projection {tree.states[node].tolist()} under control "
                                     f"{control.tolist()} held for {held} steps")
            self._add(tree, state, node, held, control)
            if goal.isSatisfied(state):
                return len(tree) - 1
        return -1

    def path(self, tree: Tree, nodes: IndexArray) -> Any:
        """Return the PathControl through nodes [T + 1]."""
        path = oc.PathControl(self._si)
        step_size = self._si.getPropagationStepSize()
        for node, child in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
            self._write_control(self._control, tree.controls[child].tolist())
            path.append(self._states[node], self._control, self._steps[child] * step_size)
        path.append(self._states[nodes[-1]])
        return path

    def state(self, tree: Tree, node: int) -> Any:
        """Return a node's state; it belongs to the door."""
        return self._states[node]

    def _add(self, tree: Tree, state: Any, parent: int, steps: int, control: Array | float) -> None:
        self._projection.project(state, self._point)
        if not np.isfinite(self._point).all():
            raise CallbackFailed(f"the projection of a state is {self._point.tolist()}, which is not finite")
        tree.append(self._point[None], parent, control, 0.0, False)
        self._states.append(state)
        self._steps.append(steps)
