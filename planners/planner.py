"""A strategy says which nodes to expand with which controls; one OMPL planner, the TreePlanner, does the rest.

Each of the two classes knows the other: `Strategy.build` makes a TreePlanner, which then asks the strategy.
"""

import inspect
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from ompl import base as ob

from pbcs_ompl.core.callbacks import callback_failed, check_finite
from pbcs_ompl.core.checked import short_repr
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption, PbcsError
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.options import check_control_duration, check_names, check_positive_integer
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, Counter, IndexArray, Solution
from pbcs_ompl.planners.compiled import CompiledStep, CompiledStrategy
from pbcs_ompl.planners.context import PlanningContext
from pbcs_ompl.planners.ompl_propagator import OmplPropagator
from pbcs_ompl.planners.propagators import BatchPropagator, ModelPropagator

ErrorType = TypeVar("ErrorType", bound=Exception)
CHUNK = 2048
"""Steps of one compiled call, after which the termination condition is polled: about a millisecond."""
PLANNER_OPTIONS = {"batch": "grow", "control_duration": 1}
"""The options, with their defaults, that every planner has beside those of its strategy."""


class Strategy(ABC):
    """Chooses nodes and controls. Subclass it and write `select`; `build` then makes an OMPL planner of it.

    The arguments of `__init__` are the planner's options. A tree belongs to one run: `start` begins it.

    Attributes:
        context: The problem, from `start` on.
        rng: The random numbers of the run, from `start` on; use no others.
        continues: Whether the search continues after its first solution, for shorter ones, until its budget ends.
    """

    context: PlanningContext
    rng: np.random.Generator
    continues = False

    def start(self, context: PlanningContext, rng: np.random.Generator) -> None:
        """Begin a new tree, which is still empty. Overriding methods call this one first."""
        self.context = context
        self.rng = rng

    def batch(self, tree: Tree) -> int:
        """Return how many nodes to select before any of them is expanded, unless the user says so."""
        return 1

    @abstractmethod
    def select(self, tree: Tree, count: int) -> IndexArray:
        """Return `count` nodes of the tree to be expanded, none of them terminal."""

    def controls(self, tree: Tree, nodes: IndexArray) -> Array:
        """Return the controls [B, A] to be tried from nodes [B]; uniform in the bounds unless overridden."""
        low, high = self.context.action_low, self.context.action_high
        return low + (high - low) * self.rng.random((len(nodes), len(low)))

    def durations(self, tree: Tree, nodes: IndexArray) -> IndexArray:
        """Return for how many steps [B] the controls from nodes [B] last; uniform in the bounds unless overridden."""
        least, most = self.context.control_durations
        if least == most:
            return np.full(len(nodes), least)
        return least + (self.rng.random(len(nodes)) * (most - least + 1)).astype(np.int64)

    def inserted(self, tree: Tree, first: int, last: int) -> None:  # noqa: B027 - optional
        """Note the new nodes first, ..., last - 1: all of them roots, or none; some may be terminal."""

    def reached(self, tree: Tree, node: int) -> None:  # noqa: B027 - optional
        """Note that a new node is in the goal, before `inserted` is called with it; where the search continues."""

    def resolved(self) -> dict[str, Any]:
        """Return the options whose values `start` took from the problem; none unless overridden."""
        return {}

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return every option of the planner with its default (see core.interfaces.PlannerFactory)."""
        arguments = {} if cls.__init__ is object.__init__ else inspect.signature(cls).parameters
        own = {name: None if argument.default is argument.empty else argument.default
               for name, argument in arguments.items()}
        return {**own, **PLANNER_OPTIONS}

    @classmethod
    def build(cls, si: Any, *, seed: int = 0, **options: Any) -> "TreePlanner":
        """Return an OMPL planner with this strategy.

        Args:
            si: The `ompl.control.SpaceInformation` of any problem.
            seed: See TreePlanner.
            options: The arguments of `__init__`, and those of TreePlanner that `options` names.

        Raises:
            InvalidOption: `__init__` knows no such option, or refuses its value.
        """
        check_names(f"planner {cls.__name__!r}", "option", options, cls.options())
        given = {**cls.options(), **options}
        of_planner = {name: given[name] for name in PLANNER_OPTIONS if name in given}
        options = {name: value for name, value in options.items() if name not in PLANNER_OPTIONS}
        try:
            strategy = cls(**options)
        except (TypeError, ValueError) as error:
            raise InvalidOption(f"planner {cls.__name__!r} refused the options {options}: {error}") from error
        return TreePlanner(si, strategy, seed=seed, **of_planner, options=given)


class TreePlanner(ob.Planner):  # type: ignore[misc] # OMPL's classes have no types
    """Selects nodes, propagates them, keeps what follows, until a node is in the goal; a strategy may continue then.

    It works on any `ompl.control.SpaceInformation`. After `use_model` it propagates through the environment itself,
    many nodes at a time. Only exact solutions are reported. Exceptions never cross OMPL: `solve` keeps the first in
    `error` and returns ABORT. A second `solve` continues with the same tree and adds start states that are new in the
    problem, but drops the tree for another problem. `clear` drops the tree and continues with the same random numbers.

    `getPlannerData` gives OMPL no nodes, because the installed OMPL aborts when Python overrides it; use `tree` or
    `planner_data`.

    Args:
        si: The `ompl.control.SpaceInformation`.
        strategy: Which nodes to expand. It belongs to this planner, whose name is that of its class.
        seed: Equal seeds give equal trees.
        batch: How many nodes are selected before any of them is expanded; "grow" leaves it to the strategy.
        control_duration: The most steps that a control lasts, or the least and the most; all durations are equally
            likely, and every step is a node. In [Matheron2020] it is 1. In an OMPL problem without an environment, 1
            stands for the bounds of the problem.
        options: The strategy's options, reported in `settings`.

    Raises:
        InvalidOption: `batch` is neither "grow" nor a positive integer, or `control_duration` no such numbers.
    """

    def __init__(self, si: Any, strategy: Strategy, *, seed: int = 0, batch: int | str = "grow",
                 control_duration: int | Sequence[int] = 1, options: Mapping[str, Any] | None = None):
        super().__init__(si, type(strategy).__name__)
        self._batch = None if batch == "grow" else check_positive_integer("batch", batch)
        self._durations = check_control_duration(control_duration)
        self._strategy = strategy
        self._options = dict(options or {"batch": batch, "control_duration": control_duration})
        self._compiled: CompiledStrategy | None = None
        if self._batch in (None, 1) and isinstance(strategy, CompiledStrategy):
            self._compiled = strategy
        self._seeds = SeedTree(seed)
        self._rng = self._seeds.child("strategy").generator()
        self._propagator: BatchPropagator | None = None
        self._tree: Tree | None = None
        self._solution: IndexArray | None = None
        self._solutions: list[Solution] = []
        self._problem: Any = None
        self._error: PbcsError | None = None

    @property
    def error(self) -> PbcsError | None:
        """What ended the last `solve` abnormally, with its cause chained; else None.

        Always a new exception: one that is raised holds the frames that it went through, and so the planner.
        If the planner held it too, OMPL would never free either.
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
    def solution(self) -> IndexArray | None:
        """The nodes [T+1] of the shortest path of the last `solve`, one a step; None unless it reached the goal."""
        return self._solution

    @property
    def solutions(self) -> list[Solution]:
        """When the last `solve` found a path shorter than all before, and its steps."""
        return list(self._solutions)

    @property
    def strategy(self) -> Strategy:
        """What chooses the nodes."""
        return self._strategy

    @property
    def settings(self) -> dict[str, Any]:
        """Every option with its value; from `solve` on with those that came from the problem."""
        return {**self._options, **({} if self._tree is None else self._strategy.resolved())}

    @property
    def transitions(self) -> int:
        """Transitions counted so far."""
        return 0 if self._propagator is None else self._propagator.counter.count

    def use_model(self, model: ResettableModel, counter: Counter) -> None:
        """Propagate through `model` from now on, and count every transition in `counter`; drops the tree."""
        self._propagator = ModelPropagator(self.getSpaceInformation(), model, counter, self._durations)
        self._tree = self._solution = None
        self._solutions = []

    def clear(self) -> None:
        """Drop the tree."""
        super().clear()
        self._tree = self._solution = self._problem = None
        self._solutions = []
        self._error = None

    def solve(self, ptc: Any) -> Any:
        """Grow the tree until the goal, the budget's end, or `ptc` (a condition, a callable or seconds).

        Where the strategy continues, the goal ends nothing, and the shortest path is the solution, be it of a `solve`
        before.
        """
        self._error = None
        if not self._strategy.continues:
            self._solution, self._solutions = None, []
        try:
            return ob.PlannerStatus(self._solve(_condition(ptc)))
        except PbcsError as error:
            self._error = error.with_traceback(None)
        except Exception as error:
            self._error = callback_failed(error, f"{self.getName()}: the environment, goal or strategy")
            self._error.__cause__ = _without_own_frames(error)
        return ob.PlannerStatus(ob.PlannerStatus.ABORT)

    def planner_data(self) -> Any:
        """Return the tree as `ompl.base.PlannerData`, which cannot hold controls in the installed OMPL."""
        data = ob.PlannerData(self.getSpaceInformation())
        if self._propagator is None or self._tree is None:
            return data
        # Vertices only point to their states: all of these have to live until the data are decoupled.
        states = [self._propagator.state(self._tree, node) for node in range(len(self._tree))]
        for state, parent in zip(states, self._tree.parents.tolist(), strict=True):
            vertex = ob.PlannerDataVertex(state)
            index = data.addStartVertex(vertex) if parent < 0 else data.addVertex(vertex)
            if parent >= 0:
                data.addEdge(parent, index)
        data.decoupleFromPlanner()
        return data

    def _solve(self, stop: Any) -> Any:
        problem = self.getProblemDefinition()
        if self._propagator is None:
            durations = self._durations if self._durations[1] > 1 else None
            self._propagator = OmplPropagator(self.getSpaceInformation(), durations)
        propagator, goal = self._propagator, problem.getGoal()
        if problem is not self._problem:  # the same C++ object is the same in Python while it is held here
            self._problem, self._tree, self._solution, self._solutions = problem, None, None, []
        began, reached = time.perf_counter(), self._add_starts(propagator, goal)
        tree = self._tree
        if tree is None:
            return ob.PlannerStatus.INVALID_START
        while True:
            if reached >= 0:
                self._keep_path(tree.path_to(reached), time.perf_counter() - began, propagator.counter.count)
            if self._solution is not None and (len(self._solution) <= 2 or not self._strategy.continues):
                break
            if propagator.counter.left == 0 or stop():
                break
            reached = self._advance(propagator, tree, goal)
        if self._solution is None:
            return ob.PlannerStatus.TIMEOUT
        problem.addSolutionPath(propagator.path(tree, self._solution))
        return ob.PlannerStatus.EXACT_SOLUTION

    def _keep_path(self, path: IndexArray, seconds: float, transitions: int) -> None:
        """Keep a path to the goal if it is the shortest so far."""
        if self._solution is None or len(path) < len(self._solution):
            self._solution = path
            self._solutions.append(Solution(transitions, seconds, len(path) - 1))

    def _add_starts(self, propagator: BatchPropagator, goal: Any) -> int:
        """Add the start states that are not in the tree yet; return one that is in the goal, or -1."""
        tree, inputs = self._tree, self.getPlannerInputStates()
        if tree is None:
            inputs.restart()
            tree = propagator.new_tree()
        first, reached = len(tree), -1
        while (state := inputs.nextStart()) is not None:
            if propagator.add_root(tree, state, goal):
                reached = len(tree) - 1
        if len(tree) > first:
            if first == 0:
                self._strategy.start(propagator.context(), self._rng)
            self._strategy.inserted(tree, first, len(tree))
            self._tree = tree
        return reached

    def _advance(self, propagator: BatchPropagator, tree: Tree, goal: Any) -> int:
        """Expand a batch of nodes; return the node in the goal, or -1."""
        strategy, left, first = self._strategy, propagator.counter.left, len(tree)
        if self._compiled is not None and isinstance(propagator, ModelPropagator) and propagator.compiled is not None:
            count = min(max(CHUNK, self._durations[1]), left)
            return _expand_compiled(self._compiled, propagator, tree, propagator.compiled, count)
        count = self._batch or min(strategy.batch(tree), propagator.max_batch)
        nodes = _checked_nodes(strategy, tree, strategy.select(tree, min(count, left)), min(count, left))
        controls = _checked_controls(strategy, strategy.controls(tree, nodes), len(nodes))
        durations = _checked_durations(strategy, strategy.durations(tree, nodes), len(nodes))
        reached = propagator.expand(tree, nodes, controls, durations, goal)
        if reached >= 0:
            strategy.reached(tree, reached)
        if len(tree) > first:
            strategy.inserted(tree, first, len(tree))
        return reached


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


def _expand_compiled(strategy: CompiledStrategy, propagator: ModelPropagator, tree: Tree, step: CompiledStep,
                     count: int) -> int:
    first = len(tree)
    reached = strategy.expand(tree, step, propagator.feature_dims, count)
    propagator.counter.count += len(tree) - first
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


def _checked_durations(strategy: Strategy, durations: Any, count: int) -> IndexArray:
    """Refuse durations that cannot be applied.

    Raises:
        CallbackFailed: not an integer above 0 for each node.
    """
    if (not isinstance(durations, np.ndarray) or durations.shape != (count,) or durations.dtype != np.int64
            or (durations < 1).any()):
        raise CallbackFailed(f"{type(strategy).__name__}.durations returned {short_repr(durations)}; expected an array "
                             f"of {count} integers (int64) above 0")
    return durations


def _checked_controls(strategy: Strategy, controls: Any, count: int) -> Array:
    """Refuse controls that cannot be applied.

    Raises:
        CallbackFailed: not a control for each node, or not within the bounds.
    """
    name, context = f"{type(strategy).__name__}.controls", strategy.context
    expected = (count, len(context.action_low))
    if not isinstance(controls, np.ndarray) or controls.shape != expected:
        got = f"an array {controls.shape}" if isinstance(controls, np.ndarray) else type(controls).__name__
        raise CallbackFailed(f"{name} returned {got}; expected an array {expected}")
    inside = (controls >= context.action_low) & (controls <= context.action_high)
    if not inside.all():
        bad = controls[~inside.all(axis=1)][0]
        raise CallbackFailed(f"{name} returned {bad.tolist()}; expected controls between "
                             f"{context.action_low.tolist()} and {context.action_high.tolist()}")
    return controls
