"""Laws of coverage: it counts the cells of every state that a transition led to, and changes nothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ompl import control as oc

from pbcs_ompl.bridge import coverage as module
from pbcs_ompl.bridge.coverage import log_spaced
from pbcs_ompl.bridge.plan import plan

PLANNERS = ["Ex", "RRTNH", oc.RRT, oc.EST, oc.KPIECE1]
LIMITS = {"seed": 3, "max_transitions": 700}


@pytest.fixture
def watched(square):
    """The square world, which keeps every state it was in after a step."""
    class Watched(square):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            self.seen = []

        def step_one(self, state, control):
            self.seen.append(super().step_one(state, control))
            return self.seen[-1]

    return Watched


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("layout", [(2, (0, 1)), (5, (3, 1)), (2, None)], ids=str)
def test_coverage_is_the_share_of_the_cells_of_all_states(watched, planner, layout):
    model = watched(*layout)
    found = plan(model, planner, coverage=True, **LIMITS)
    seen = np.array(model.seen[:found.transitions])  # then come the steps of the replay
    cells = np.minimum(model.feature(seen) // model.bin_size, 19).astype(int)
    expected = [len(set(map(tuple, cells[:count].tolist()))) / 400 for count in found.coverage.transitions]
    assert found.coverage.share.tolist() == expected
    assert found.coverage.transitions.tolist() == log_spaced(found.transitions).tolist()
    assert (np.diff(found.coverage.seconds) >= 0).all()
    assert 0 <= found.coverage.seconds[0] <= found.coverage.seconds[-1] == found.seconds


@pytest.mark.parametrize("planner", PLANNERS)
def test_asking_for_coverage_changes_nothing_else(square, planner):
    asked, unasked = (plan(square(), planner, coverage=coverage, **LIMITS) for coverage in (True, False))
    assert unasked.coverage is None
    assert np.array_equal(asked.tree.states, unasked.tree.states)
    ours, theirs = ({**result.summary(), "seconds": 0} for result in (asked, unasked))
    assert ours == theirs


def test_a_grid_of_too_many_cells_gets_larger_cells(square, monkeypatch):
    fine = plan(square(), "Ex", coverage=True, **LIMITS).coverage
    monkeypatch.setattr(module, "MOST_CELLS", 100)  # 10 x 10 of the 20 x 20
    coarse = plan(square(), "Ex", coverage=True, **LIMITS).coverage
    assert coarse.share[0] == 1 / 100
    assert fine.share[0] == 1 / 400
    assert (coarse.share >= fine.share).all()


class Secretive:
    """Builds a planner that propagates through the model and keeps no tree."""

    @staticmethod
    def options():
        return {}

    @staticmethod
    def build(si, *, seed):
        from pbcs_ompl.planners import Ex, TreePlanner

        class Forgetful(TreePlanner):
            @property
            def tree(self):
                return None

        return Forgetful(si, Ex(), seed=seed)


def test_no_coverage_where_the_states_are_not_known_one_by_one(square):
    assert plan(square(), Secretive, coverage=True, **LIMITS).coverage is None


@given(st.integers(0, 10**9))
def test_points_are_log_spaced_and_end_at_the_last_transition(most):
    points = log_spaced(most)
    assert (np.diff(points) > 0).all()
    assert points.tolist()[-1:] == ([most] if most else [])
    assert len(points) <= 10 * np.log10(max(most, 1)) + 2
    if most >= 10:
        assert points[:7].tolist() == [1, 2, 3, 4, 5, 6, 8]


@pytest.mark.parametrize(("planner", "least", "most"), [("Ex", 1, 1), (oc.KPIECE1, 1, 1), (oc.EST, 300, 5000)])
def test_collision_checks_are_the_transitions_and_the_states_ompl_made_up(square, planner, least, most):
    found = plan(square(), planner, **LIMITS)
    assert least <= found.collision_checks - found.transitions <= most
