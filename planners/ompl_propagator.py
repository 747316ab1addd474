"""Advance states through OMPL's own propagator, for planners without an environment."""

from typing import Any

import numpy as np
from ompl import control as oc

from pbcs_ompl.core.errors import CallbackFailed, UnsupportedSpace
from pbcs_ompl.core.ompl_access import real_bounds, value_writer
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.propagators import BatchPropagator


class OmplPropagator(BatchPropagator):
    """Advances one state at a time of any `ompl.control.SpaceInformation`; for planners without an environment.

    The feature is the default projection, as for OMPL's KPIECE1 and EST. A control ends where the motion becomes
    invalid; the last state is kept if the control lasted the least number of steps, as OMPL's own planners do. In the
    tree, the states are the projections. Rewards are 0, no state is terminal, and the goal is the problem's.

    Args:
        si: The problem.
        durations: The least and the most steps that a control lasts; None for the problem's.

    Raises:
        UnsupportedSpace: no default projection, or controls that are not real vectors.
    """

    max_batch = 1

    def __init__(self, si: Any, durations: tuple[int, int] | None):
        if not si.isSetup():
            si.setup()
        space = si.getStateSpace()
        if not space.hasDefaultProjection():
            raise UnsupportedSpace(f"the state space {space.getName()!r} has no default projection; "
                                   "register one with registerDefaultProjection")
        self.counter = Counter()
        self._si = si
        self._projection = space.getDefaultProjection()
        self._point = np.empty(self._projection.getDimension())
        self._control_bounds = real_bounds(si.getControlSpace())
        self._write_control = value_writer(si.getControlSpace())
        self._control = si.allocControl()
        self._durations = durations or (si.getMinControlDuration(), si.getMaxControlDuration())
        self._states: list[Any] = []
        self._steps: list[int] = []

    def context(self) -> PlanningContext:
        """Describe the projection and the controls for a strategy."""
        size = len(self._point)
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        if self._projection.hasBounds():
            box = self._projection.getBounds()
            low, high = np.array(box.low), np.array(box.high)
        return PlanningContext(low, high, np.array(self._projection.getCellSizes()), *self._control_bounds,
                               control_durations=self._durations)

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

    def expand(self, tree: Tree, nodes: IndexArray, controls: Array, durations: IndexArray, goal: Any) -> int:
        """Propagate each node; a motion that is invalid from the start adds nothing, any other its last state."""
        least = self._durations[0]
        for node, control, steps in zip(nodes.tolist(), controls, durations.tolist(), strict=True):
            self._write_control(self._control, control.tolist())
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
