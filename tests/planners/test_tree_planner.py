"""TreePlanner: budget, goal, counting, and strategies that misbehave."""

import numpy as np
import pytest
from ompl import base as ob

from pbcs_ompl.bridge.trajectory import to_trajectory
from pbcs_ompl.core.errors import CallbackFailed, InvalidOption, Mismatch
from pbcs_ompl.core.types import Counter
from pbcs_ompl.planners import RRTNH, ESTAdapted, Ex, RandomWalk, RRTSteered, Strategy, Tree

OURS = [Ex, RRTNH, RRTSteered, ESTAdapted, RandomWalk]
EXACT, TIMEOUT, ABORT = (ob.PlannerStatus.EXACT_SOLUTION, ob.PlannerStatus.TIMEOUT, ob.PlannerStatus.ABORT)


class Uniform(Strategy):
    """A user's strategy: any node that is not terminal."""

    def __init__(self, width: int = 1):
        self.width = width
        self.seen: list[tuple[int, int]] = []

    def batch(self, tree: Tree) -> int:
        return self.width

    def select(self, tree, count):
        return self.rng.choice(np.flatnonzero(~tree.terminal), count)

    def inserted(self, tree, first, last):
        self.seen.append((first, last))


def check_tree(model, tree):
    """Every node is what its parent and control lead to, and no terminal node has children."""
    parents = tree.parents[1:]
    result = model.transition(tree.states[parents], tree.controls[1:])
    assert np.array_equal(result.states, tree.states[1:])
    assert np.array_equal(result.rewards, tree.rewards[1:])
    assert np.array_equal(result.terminated, tree.terminal[1:])
    assert (parents < np.arange(1, len(tree))).all()
    assert not tree.terminal[parents].any()


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("kind", OURS, ids=lambda kind: kind.__name__)
def test_tree_path_and_count_belong_together(solve, square, kind, terminal):
    model = square(extent=1.5, goal=1.2, terminal=terminal)
    planner, status, counter, setup = solve(lambda si: kind.build(si, seed=2), model, 60_000)
    assert planner.error is None
    check_tree(model, planner.tree)
    assert counter.count == len(planner.tree) - 1 == planner.transitions
    if kind is not RandomWalk:
        assert status == EXACT
    if status == EXACT:
        path = setup.getSolutionPath()
        nodes = planner.tree.path_to(len(planner.tree) - 1)
        assert path.check()
        trajectory = to_trajectory(path, setup.getSpaceInformation(), model)
        assert trajectory.states.tolist() == planner.tree.states[nodes].tolist()
        assert trajectory.controls.tolist() == planner.tree.controls[nodes[1:]].tolist()
        assert model.goal_distance(planner.tree.states)[:-1].min() >= model.goal_threshold
        assert setup.haveExactSolutionPath()


@pytest.mark.parametrize("kind", OURS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("budget", [1, 777])
def test_budgets_are_kept_to_the_transition(solve, square, kind, budget):
    planner, status, counter, setup = solve(lambda si: kind.build(si), square(goal=9.0), budget)
    assert status == TIMEOUT
    assert counter.count == budget == len(planner.tree) - 1
    assert not setup.haveSolutionPath()


@pytest.mark.parametrize("kind", OURS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("batch", ["grow", 1, 64])
def test_equal_seeds_give_equal_trees(solve, square, kind, batch):
    trees = [solve(lambda si, s=seed: kind.build(si, seed=s, batch=batch), square(goal=9.0), 500)[0].tree
             for seed in (5, 5, 6)]
    assert np.array_equal(trees[0].states, trees[1].states)
    assert not np.array_equal(trees[0].states, trees[2].states)


def test_a_users_strategy_becomes_a_planner(solve, square):
    make = lambda si: Uniform.build(si, seed=1, width=7)  # noqa: E731
    planner, status, counter, _ = solve(make, square(extent=1.0, goal=0.9), 50_000)
    assert status == EXACT
    assert planner.getName() == "Uniform"
    seen = planner.strategy.seen
    assert seen[0] == (0, 1)
    assert [first for first, _ in seen[1:]] == [last for _, last in seen[:-1]]
    assert seen[-1][1] == counter.count + 1


def test_features_that_are_no_dimensions_of_the_state(solve, square):
    class Diagonal(square):
        feature_dims = None

        def __init__(self):
            super().__init__()
            self.feature_low, self.feature_high, self.bin_size = np.zeros(1), np.full(1, 6.0), np.full(1, 0.2)

        def feature(self, states):
            return states.sum(axis=1, keepdims=True)

        def compiled_step(self):
            raise AssertionError("compiled loops need features that are dimensions of the state")

    planner, status, _, _ = solve(lambda si: Ex.build(si), Diagonal(), 50_000)
    assert status == EXACT
    assert np.array_equal(planner.tree.features[:, 0], planner.tree.states.sum(axis=1))


@pytest.mark.parametrize(("returned", "message"), [
    ([0], "list; expected an array of 1 integers"),
    (np.zeros(1), "float64"),
    (np.zeros(2, int), r"\(2,\)"),
    (np.array([7]), "node 7; expected 0 to 0"),
    (np.array([-1]), "node -1"),
], ids=["list", "floats", "too many", "beyond", "negative"])
def test_bad_nodes_are_named(solve, square, returned, message):
    class Bad(Strategy):
        def select(self, tree, count):
            return returned

    planner, status, counter, _ = solve(lambda si: Bad.build(si, seed=1), square())
    assert status == ABORT
    assert isinstance(planner.error, CallbackFailed)
    assert counter.count == 0
    with pytest.raises(CallbackFailed, match=r"Bad\.select returned.*" + message):
        raise planner.error


@pytest.mark.parametrize(("returned", "message"), [
    (np.zeros((2, 2)), r"\(2, 2\)"), (np.full((1, 2), 0.2), "expected controls between"),
    (np.full((1, 2), np.nan), "nan"), (None, "NoneType"),
], ids=["shape", "outside", "nan", "none"])
def test_bad_controls_are_named(solve, square, returned, message):
    class Bad(Uniform):
        def controls(self, tree, nodes):
            return returned

    planner, _, _, _ = solve(lambda si: Bad.build(si, seed=1), square())
    with pytest.raises(CallbackFailed, match=r"Bad\.controls returned.*" + message):
        raise planner.error


def test_terminal_nodes_are_refused(solve, square):
    class Newest(Strategy):
        def select(self, tree, count):
            return np.array([len(tree) - 1])

    class Deadly(square):
        def transition(self, states, controls):
            return super().transition(states, controls)._replace(terminated=np.ones(len(states), bool))

    planner, _, _, _ = solve(lambda si: Newest.build(si, seed=1), Deadly())
    with pytest.raises(CallbackFailed, match="node 1, which is terminal"):
        raise planner.error


def test_exceptions_are_chained_and_hold_no_planner(solve, square):
    class Bad(Uniform):
        def select(self, tree, count):
            raise KeyError("lost")

    planner, status, _, _ = solve(lambda si: Bad.build(si, seed=1), square())
    assert status == ABORT
    assert "KeyError" in str(planner.error)
    trace = planner.error.__cause__.__traceback__
    while trace is not None:
        assert planner not in trace.tb_frame.f_locals.values()
        trace = trace.tb_next


@pytest.mark.parametrize("bad", ["nan", "shape", "raises"])
def test_bad_models_are_named(solve, square, bad):
    class Bad(square):
        def transition(self, states, controls):
            result = super().transition(states, controls)
            if bad == "raises":
                raise RuntimeError("no contact")
            if bad == "nan":
                return result._replace(states=result.states * np.nan)
            return result._replace(success=result.success[:0])

    planner, status, _, _ = solve(lambda si: Ex.build(si), Bad())
    assert status == ABORT
    expected = {"nan": r"from state \[0.5, 0.5\] with control", "shape": "success of shape",
                "raises": "no contact"}[bad]
    with pytest.raises(CallbackFailed, match=expected):
        raise planner.error


@pytest.mark.parametrize("batch", [0, -1, 1.5, True, "shrink"])
def test_bad_batches_are_refused(make_setup, square, batch):
    with pytest.raises(InvalidOption, match="batch"):
        Ex.build(make_setup(square()).getSpaceInformation(), batch=batch)


def test_unknown_options_suggest_the_closest(make_setup, square):
    si = make_setup(square()).getSpaceInformation()
    with pytest.raises(InvalidOption, match=r"'bin_sise'.*did you mean 'bin_size'"):
        Ex.build(si, bin_sise=0.1)
    with pytest.raises(InvalidOption, match=r"'Uniform' has no option 'with'.*'width'"):
        Uniform.build(si, seed=1, **{"with": 3})
    with pytest.raises(InvalidOption, match=r"'goal_bias'; choose from batch, control_duration"):
        RRTNH.build(si, seed=1, goal_bias=0.1)
    with pytest.raises(InvalidOption, match=r"'control_durations'; did you mean 'control_duration'"):
        Ex.build(si, seed=1, control_durations=3)


def test_a_model_of_another_size_is_refused(make_setup, square):
    model = square()
    planner = Ex.build(make_setup(model).getSpaceInformation())
    model.state_low = np.zeros(3)
    with pytest.raises(Mismatch, match="states of 2 dimensions, the environment of 3"):
        planner.use_model(model, Counter())


def test_clear_drops_the_tree_and_continues_the_stream(solve, square):
    planner, _, counter, _ = solve(lambda si: Ex.build(si), square(goal=9.0), 300)
    first = planner.tree.states.copy()
    planner.clear()
    assert planner.tree is None
    counter.count = 0
    planner.solve(ob.PlannerTerminationCondition(lambda: False))
    assert planner.tree.states.shape == first.shape
    assert not np.array_equal(planner.tree.states, first)


def add_start(setup, x, y):
    start = setup.getSpaceInformation().allocState()
    start[0], start[1] = x, y
    setup.getProblemDefinition().addStartState(start)


@pytest.mark.parametrize("kind", OURS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("through_model", [True, False], ids=["model", "OMPL"])
def test_a_start_state_added_after_a_time_out_is_used(make_setup, square, kind, through_model):
    """Behind a wall lies the first start; the second one reaches the goal, as with OMPL's own planners."""
    class Divided(square):
        def transition(self, states, controls):
            result = super().transition(states, controls)
            crossed = (states[:, 0] < 1.0) != (result.states[:, 0] < 1.0)
            after = np.where(crossed[:, None], states, result.states)
            success = self.goal_distance(after) < self.goal_threshold
            return result._replace(states=after, success=success, terminated=success)

    if kind is RRTSteered and not through_model:
        pytest.skip("steering needs an environment")
    model = Divided(extent=1.5, goal=1.3, radius=0.2)
    setup = make_setup(model)
    planner = kind.build(setup.getSpaceInformation(), seed=1)
    if through_model:
        planner.use_model(model, Counter())
    setup.setPlanner(planner)
    setup.setup()
    polls = iter(range(300))
    assert planner.solve(lambda: next(polls) == 299).getStatus() == TIMEOUT
    size = len(planner.tree)
    assert (planner.tree.states[:, 0] < 1.0).all()
    add_start(setup, 1.2, 0.9)
    assert planner.solve(20.0).getStatus() == EXACT
    assert planner.tree.parents[:size + 1].tolist().count(-1) == 2
    assert np.array_equal(planner.tree.states[size], [1.2, 0.9])
    path = planner.tree.path_to(len(planner.tree) - 1)
    assert path[0] == size
    assert setup.getSolutionPath().getStateCount() == len(path)
    assert planner.solve(lambda: True).getStatus() == TIMEOUT
    assert planner.tree.parents.tolist().count(-1) == 2


def test_a_start_state_added_in_the_goal_is_a_path_of_one_state(solve, square):
    planner, status, _, setup = solve(lambda si: Ex.build(si), square(), 10)
    assert status == TIMEOUT
    add_start(setup, 2.7, 2.7)
    assert planner.solve(lambda: False).getStatus() == EXACT
    assert setup.getSolutionPath().getStateCount() == 1


def test_a_pickled_tree_has_its_nodes_and_no_reserved_rows(solve, compiled_square):
    import pickle

    tree = solve(lambda si: Ex.build(si), compiled_square(), 50_000)[0].tree
    pickled = pickle.dumps(tree)
    again = pickle.loads(pickled)
    assert len(pickled) < 1.1 * tree.nbytes + 2000
    assert np.array_equal(again.states, tree.states)
    assert again.columns.features is again.columns.states
    assert np.array_equal(again.path_to(len(again) - 1), tree.path_to(len(tree) - 1))
