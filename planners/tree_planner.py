"""The one OMPL planner of this package: it grows a tree, and a strategy says where."""

from typing import Any, ClassVar, Self, TypeVar

import numpy as np
from ompl import base as ob

from pbcs_ompl.core.errors import CallbackFailed, PbcsError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, Counter, IndexArray
from pbcs_ompl.planners.compiled import CompiledStep, CompiledStrategy
from pbcs_ompl.planners.door import Door
from pbcs_ompl.planners.model_door import ModelDoor, check_finite
from pbcs_ompl.planners.ompl_door import OmplDoor
from pbcs_ompl.planners.options import positive_integer
from pbcs_ompl.planners.strategy import Strategy
from pbcs_ompl.planners.tree import Tree

ErrorType = TypeVar("ErrorType", bound=Exception)
CHUNK = 2048
"""Expansions of one compiled call, between two looks at the termination condition: about a millisecond."""


class TreePlanner(ob.Planner):
    """Selects nodes, propagates them, keeps what follows, until a node is in the goal.

    It works on any `ompl.control.SpaceInformation`. After `use_model` it propagates through the environment
    itself, many nodes at a time. Only exact solutions are reported. Exceptions never cross OMPL: `solve`
    keeps the first in `error` and answers ABORT. A second `solve` goes on with the same tree; `clear` drops
    it and goes on with the same random numbers.

    `getPlannerData` tells OMPL of no nodes, because the installed OMPL aborts when Python overrides it; use
    `tree` or `planner_data`.

    Args:
        si: The `ompl.control.SpaceInformation`.
        name: The planner's name.
        strategy: Which nodes to expand. It belongs to this planner.
        seed: Equal seeds give equal trees.
        batch: How many nodes are selected before any of them is expanded; "grow" leaves it to the strategy.
        hold: Each control is held for 1 to so many steps, all lengths equally likely; every step is a node.
            [Matheron2020] holds none (1). Steps are then not made in compiled loops.

    Raises:
        InvalidOption: `batch` is neither "grow" nor a positive integer, or `hold` is none.
    """

    def __init__(self, si: Any, name: str, strategy: Strategy, *, seed: int = 0, batch: int | str = "grow",
                 hold: int = 1):
        super().__init__(si, name)
        self._batch = None if batch == "grow" else positive_integer("batch", batch)
        self._hold = positive_integer("hold", hold)
        self._strategy = strategy
        self._compiled: CompiledStrategy | None = None
        if self._batch in (None, 1) and self._hold == 1 and isinstance(strategy, CompiledStrategy):
            self._compiled = strategy
        self._seeds = SeedTree(seed)
        self._rng = self._seeds.child("strategy").generator()
        self._door: Door | None = None
        self._tree: Tree | None = None
        self._error: PbcsError | None = None

    @property
    def error(self) -> PbcsError | None:
        """What ended the last `solve` abnormally, with its cause chained; else None.

        Always a new exception: one that is raised holds the frames that it went through, and so the planner.
        If the planner held it too, OMPL would never be rid of either.
        """
        if self._error is None:
            return None
        kind = type(self._error)
        error = kind.__new__(kind, *self._error.args)
        error.__cause__ = self._error.__cause__
        return error

    @property
    def tree(self) -> Tree | None:
        """The tree as arrays; None before `solve`."""
        return self._tree

    @property
    def strategy(self) -> Strategy:
        """What chooses the nodes."""
        return self._strategy

    @property
    def transitions(self) -> int:
        """Transitions counted so far."""
        return 0 if self._door is None else self._door.counter.count

    def use_model(self, model: ResettableModel, counter: Counter) -> None:
        """Propagate through `model` from now on, and count every transition in `counter`; drops the tree."""
        self._door = ModelDoor(self.getSpaceInformation(), model, counter)
        self._tree = None

    def clear(self) -> None:
        """Forget the tree."""
        super().clear()
        self._tree = None
        self._error = None

    def solve(self, ptc: Any) -> Any:
        """Grow the tree until the goal, the budget's end, or `ptc` (a condition, a callable or seconds)."""
        self._error = None
        try:
            return ob.PlannerStatus(self._solve(_condition(ptc)))
        except PbcsError as error:
            self._error = error.with_traceback(None)
        except Exception as error:
            self._error = _failure(self.getName(), _without_own_frames(error))
        return ob.PlannerStatus(ob.PlannerStatus.ABORT)

    def planner_data(self) -> Any:
        """Return the tree as `ompl.base.PlannerData`, which cannot hold controls in the installed OMPL."""
        data = ob.PlannerData(self.getSpaceInformation())
        if self._door is None or self._tree is None:
            return data
        # Vertices only point to their states: all of these have to live until the data are decoupled.
        states = [self._door.state(self._tree, node) for node in range(len(self._tree))]
        for state, parent in zip(states, self._tree.parents.tolist(), strict=True):
            vertex = ob.PlannerDataVertex(state)
            index = data.addStartVertex(vertex) if parent < 0 else data.addVertex(vertex)
            if parent >= 0:
                data.addEdge(parent, index)
        data.decoupleFromPlanner()
        return data

    def _solve(self, stop: Any) -> Any:
        problem = self.getProblemDefinition()
        if self._door is None:
            self._door = OmplDoor(self.getSpaceInformation(), self._seeds.child("durations").generator())
        goal, reached = problem.getGoal(), -1
        if self._tree is None:
            reached = self._plant(self._door, goal)
        tree = self._tree
        if tree is None:
            return ob.PlannerStatus.INVALID_START
        while reached < 0:
            if self._door.counter.left == 0 or stop():
                return ob.PlannerStatus.TIMEOUT
            reached = self._advance(self._door, tree, goal)
        problem.addSolutionPath(self._door.path(tree, tree.path_to(reached)))
        return ob.PlannerStatus.EXACT_SOLUTION

    def _plant(self, door: Door, goal: Any) -> int:
        """Begin the tree with the start states; return one that is in the goal, or -1."""
        tree = door.new_tree()
        reached = self._add_roots(door, tree, goal)
        if len(tree) > 0:
            self._strategy.start(door.space(), self._rng)
            self._strategy.inserted(tree, 0, len(tree))
            self._tree = tree
        return reached

    def _add_roots(self, door: Door, tree: Tree, goal: Any) -> int:
        reached = -1
        inputs = self.getPlannerInputStates()
        inputs.restart()
        while (state := inputs.nextStart()) is not None:
            if door.add_root(tree, state, goal):
                reached = len(tree) - 1
        return reached

    def _advance(self, door: Door, tree: Tree, goal: Any) -> int:
        """Expand a batch of nodes; return the node in the goal, or -1."""
        strategy, left, first = self._strategy, door.counter.left, len(tree)
        if self._compiled is not None and isinstance(door, ModelDoor) and door.compiled is not None:
            return _expand_compiled(self._compiled, door, tree, door.compiled, min(CHUNK, left))
        count = self._batch or min(strategy.batch(tree), door.widest_batch)
        nodes = _checked_nodes(strategy, tree, strategy.select(tree, min(count, left)), min(count, left))
        controls = _checked_controls(strategy, strategy.controls(tree, nodes), len(nodes))
        reached = door.expand(tree, nodes, controls, goal)
        if reached < 0 and self._hold > 1:
            reached = self._hold_controls(door, tree, goal, first)
        if len(tree) > first:
            strategy.inserted(tree, first, len(tree))
        return reached

    def _hold_controls(self, door: Door, tree: Tree, goal: Any, first: int) -> int:
        """Apply the controls of the nodes from `first` on again, for as long as each is held; return as above."""
        nodes = np.arange(first, len(tree))
        steps = self._rng.integers(0, self._hold, len(nodes))
        for step in range(self._hold - 1):
            going = np.flatnonzero((steps > step) & ~tree.terminal[nodes])[:door.counter.left]
            if not len(going):
                break
            nodes, steps, before = nodes[going], steps[going], len(tree)
            reached = door.expand(tree, nodes, tree.controls[nodes], goal)
            if reached >= 0:
                return reached
            grown = np.arange(before, len(tree))  # fewer than `nodes` where a motion was not valid
            nodes, steps = grown, steps[np.searchsorted(nodes, tree.parents[grown])]
        return -1


class StrategyPlanner(TreePlanner):
    """A TreePlanner that is named after its class and makes its strategy from its options.

    Raises:
        InvalidOption: the strategy knows no such option, or refuses its value.
    """

    strategy_class: ClassVar[type[Strategy]]

    def __init__(self, si: Any, *, seed: int = 0, batch: int | str = "grow", hold: int = 1, **options: Any):
        name = type(self).__name__
        strategy = self.strategy_class.from_options(options, name)
        super().__init__(si, name, strategy, seed=seed, batch=batch, hold=hold)

    @classmethod
    def build(cls, si: Any, *, seed: int, **options: Any) -> Self:
        """Return a new planner (see core.interfaces.PlannerFactory)."""
        return cls(si, seed=seed, **options)


def _condition(ptc: Any) -> Any:
    """Return the termination condition that `solve` was given, in any form that OMPL's own planners take."""
    if isinstance(ptc, ob.PlannerTerminationCondition):
        return ptc
    if callable(ptc):
        return ob.PlannerTerminationCondition(ptc)
    return ob.timedPlannerTerminationCondition(float(ptc))


def _without_own_frames(error: ErrorType) -> ErrorType:
    """Cut the traceback where it leaves this module: its frames hold the planner, which holds the error."""
    trace = error.__traceback__
    while trace is not None and trace.tb_frame.f_code.co_filename == __file__:
        trace = trace.tb_next
    return error.with_traceback(trace)


def _failure(planner: str, error: Exception) -> CallbackFailed:
    text = " ".join(str(error).split()) or "no message"
    failure = CallbackFailed(f"{planner} met an exception in the environment, goal or strategy: "
                             f"{type(error).__name__}: {text}")
    failure.__cause__ = error
    return failure


def _expand_compiled(strategy: CompiledStrategy, door: ModelDoor, tree: Tree, step: CompiledStep,
                     count: int) -> int:
    first = len(tree)
    reached = strategy.expand(tree, step, door.feature_dims, count)
    door.counter.count += len(tree) - first
    check_finite(tree.states[tree.parents[-1:]], tree.controls[-1:], tree.states[-1:])
    return reached


def _checked_nodes(strategy: Strategy, tree: Tree, nodes: Any, count: int) -> IndexArray:
    """Refuse nodes that cannot be expanded.

    Raises:
        CallbackFailed: not `count` integers within the tree, or a terminal node.
    """
    name = f"{type(strategy).__name__}.select"
    if not isinstance(nodes, np.ndarray) or nodes.shape != (count,) or nodes.dtype.kind not in "iu":
        got = f"{nodes.dtype} {nodes.shape}" if isinstance(nodes, np.ndarray) else type(nodes).__name__
        raise CallbackFailed(f"{name} returned {got}; expected an array of {count} integers")
    outside = (nodes < 0) | (nodes >= len(tree))
    if outside.any():
        raise CallbackFailed(f"{name} returned the node {nodes[outside][0]}; expected 0 to {len(tree) - 1}")
    if tree.terminal[nodes].any():
        raise CallbackFailed(f"{name} returned the node {nodes[tree.terminal[nodes]][0]}, which is terminal")
    return nodes


def _checked_controls(strategy: Strategy, controls: Any, count: int) -> Array:
    """Refuse controls that cannot be applied.

    Raises:
        CallbackFailed: not a control for each node, or not within the bounds.
    """
    name, space = f"{type(strategy).__name__}.controls", strategy.space
    expected = (count, len(space.action_low))
    if not isinstance(controls, np.ndarray) or controls.shape != expected:
        got = f"an array {controls.shape}" if isinstance(controls, np.ndarray) else type(controls).__name__
        raise CallbackFailed(f"{name} returned {got}; expected an array {expected}")
    inside = (controls >= space.action_low) & (controls <= space.action_high)
    if not inside.all():
        bad = controls[~inside.all(axis=1)][0]
        raise CallbackFailed(f"{name} returned {bad.tolist()}; expected controls between "
                             f"{space.action_low.tolist()} and {space.action_high.tolist()}")
    return controls
