"""OMPL's own planners as registry entries."""

import pytest
from ompl import base as ob
from ompl import control as oc

from pbcs_ompl.core.errors import InvalidOption, PlannerUnavailable
from pbcs_ompl.planners import stock

BUILDABLE = ("RRT", "EST", "KPIECE1")


@pytest.mark.parametrize("name", BUILDABLE)
def test_they_solve_the_square(make_setup, square, name):
    setup = make_setup(square(extent=1.0, goal=0.9))
    planner = getattr(stock, name).build(setup.getSpaceInformation(), seed=1)
    assert isinstance(planner, getattr(oc, name))
    setup.setPlanner(planner)
    assert setup.solve(10.0).getStatus() == ob.PlannerStatus.EXACT_SOLUTION


def test_rrt_has_no_goal_bias_unless_asked(make_setup, square):
    si = make_setup(square()).getSpaceInformation()
    assert stock.RRT.build(si, seed=1).getGoalBias() == 0.0
    biased = stock.RRT.build(si, seed=1, goal_bias=0.2, intermediate_states=True)
    assert biased.getGoalBias() == pytest.approx(0.2)
    assert biased.getIntermediateStates()


def test_options_are_checked(make_setup, square):
    si = make_setup(square()).getSpaceInformation()
    with pytest.raises(InvalidOption, match="did you mean 'goal_bias'"):
        stock.RRT.build(si, seed=1, goal_bais=0.2)
    with pytest.raises(InvalidOption, match="refused goal_bias='much'"):
        stock.RRT.build(si, seed=1, goal_bias="much")


@pytest.mark.parametrize("name", ["SST", "PDST", "SyclopRRT", "SyclopEST"])
def test_what_cannot_be_built_says_why(make_setup, square, name):
    """A newer OMPL may be able to: then this test is to be changed, and nothing else."""
    si = make_setup(square()).getSpaceInformation()
    with pytest.raises(PlannerUnavailable, match=r"the installed OMPL .* cannot") as caught:
        getattr(stock, name).build(si, seed=1)
    assert caught.value.exit_code == 3


def test_a_class_that_does_not_exist_is_unavailable(make_setup, square):
    with pytest.raises(PlannerUnavailable, match="has no HyRRT2"):
        stock.StockPlanner("HyRRT2").build(make_setup(square()).getSpaceInformation(), seed=1)
