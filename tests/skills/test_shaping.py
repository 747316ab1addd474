"""The shaped reward against rows computed by hand, and its laws."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.skills.shaping import GOAL_REWARD, shaped_rewards

distances = st.lists(st.floats(0.11, 50.0), min_size=2, max_size=30)


def test_rows_computed_by_hand():
    before = np.array([1.0, 0.5, 2.0, 0.05])
    after = np.array([0.5, 1.0, 0.1, 1.0])
    reached = np.array([False, False, True, False])
    # 1/0.5 - 1/1 = 1; 1/1 - 1/0.5 = -1; reached: 10; 1/1 - 1/0.1 = -9 (0.05 is bounded below by the radius 0.1)
    np.testing.assert_allclose(shaped_rewards(before, after, reached, 0.1), [1.0, -1.0, GOAL_REWARD, -9.0])


@given(distances)
def test_a_path_earns_the_difference_of_potentials_of_its_ends(along):
    """Ng et al. 1999: a potential cannot be collected by going round in circles."""
    before, after = np.array(along[:-1]), np.array(along[1:])
    total = shaped_rewards(before, after, np.zeros(len(before), bool), 0.1).sum()
    np.testing.assert_allclose(total, 1 / along[-1] - 1 / along[0], atol=1e-9)


@given(distances)
def test_no_step_outside_the_goal_is_worth_as_much_as_reaching_it(along):
    before, after = np.array(along[:-1]), np.array(along[1:])
    assert (shaped_rewards(before, after, np.zeros(len(before), bool), 0.1) < GOAL_REWARD).all()
