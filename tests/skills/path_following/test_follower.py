"""The controller of a line: a batch is as many single episodes, the pointer is its own, policies take over in order."""

import numpy as np
import pytest

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.skills.path_following.follower import Follower, LineView, Progress
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.path_following.shown_feature import ShownFeature
from pbcs_ompl.skills.policy import ObservationTransform

LOW, HIGH = np.full(2, -0.1), np.full(2, 0.1)
LINE = Line.through(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]), 0.5)
VIEW = LineView(shown=ShownFeature.plain(np.array([2, 0])), unit=np.array([0.1, 0.1]),
                normaliser=ObservationTransform(np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0, 2.0])),
                distances=np.array([1.0, 2.0]), window=2.0, patience=10)


def towards_the_line(gain: float) -> Policy:
    """A linear policy: `gain` times the first point ahead (inputs 3 and 4), on the second and first entry."""
    weight = np.zeros((VIEW.size, 2), dtype=np.float32)
    weight[3, 0] = weight[4, 1] = gain
    return Policy(((weight, np.zeros(2, dtype=np.float32)),), LOW, HIGH)


def follower(*gains: float) -> Follower:
    return Follower([towards_the_line(gain) for gain in gains or (5.0,)], [0, 25][:len(gains) or 1], LINE, VIEW,
                    ActionMap(LOW, HIGH, LOW.shape))


def observed(positions: np.ndarray) -> np.ndarray:
    """Observations of positions [B, 2]: the second, an entry that does not matter, the first."""
    return np.stack([positions[:, 1], np.full(len(positions), 7.0), positions[:, 0]], axis=1)


def test_inputs_are_the_normalised_observation_the_points_ahead_and_the_stall() -> None:
    inputs = VIEW.inputs(observed(np.array([[0.1, 0.02]])), LINE, Progress(np.array([2]), np.array([5])))
    np.testing.assert_allclose(inputs[0], [(0.02 - 1) / 2, 2.5, (0.1 - 3) / 2, 1.0, -0.2, 2.0, -0.2, 0.5])
    assert inputs.shape == (1, VIEW.size)
    late = VIEW.inputs(observed(np.array([[0.1, 0.02]])), LINE, Progress(np.array([2]), np.array([500])))
    assert late[0, -1] == 1.0


def test_it_drives_along_the_line_to_its_end() -> None:
    controller = follower()
    controller.reset()
    position = np.array([[0.0, 0.0]])
    pointers = []
    for _ in range(60):
        position = position + controller.act(observed(position)[0])
        pointers.append(int(controller.progress.pointers[0]))
    assert (np.diff(pointers) >= 0).all()
    assert pointers[-1] == LINE.last
    np.testing.assert_allclose(position[0], [1.0, 1.0], atol=0.1)


def test_without_progress_the_pointer_goes_back_to_where_the_episode_is_and_no_further_than_it_came() -> None:
    before = Progress(np.array([20, 20, 20, 8]), np.array([10, 9, 30, 10]))
    places = np.array([[2.6, 0.1], [2.6, 0.1], [9.9, 0.0], [9.0, 0.0]])  # at points 5, 5, 20 and 18
    for periods in (None, np.array([100.0, 0.0])):
        line = Line(LINE.points, LINE.spacing, 1.0, periods)
        for turns in [np.zeros(4)] if periods is None else [np.zeros(4), np.array([1.0, 0.0, -2.0, 0.0])]:
            there = places + np.outer(turns, [100.0, 0.0])
            after = before.advanced(line, there, 2.0, lost_after=10)
            assert after.pointers.tolist() == [5, 20, 20, 12]
            assert after.stalled.tolist() == [0, 10, 0, 0]
    never = before.advanced(LINE, places, 2.0)
    assert never.pointers.tolist() == [20, 20, 20, 12]
    assert never.stalled.tolist() == [11, 10, 31, 0]


def test_a_batch_is_as_many_single_episodes() -> None:
    rng = np.random.default_rng(0)
    walks = np.cumsum(rng.uniform(0.0, 0.1, (20, 3, 2)), axis=0)
    together = follower(5.0, 1.0)
    together.reset(3)
    batch = np.array([together.act(observed(positions)) for positions in walks])
    for member in range(3):
        alone = follower(5.0, 1.0)
        alone.reset()
        np.testing.assert_array_equal(batch[:, member], [alone.act(one) for one in observed(walks[:, member])])
    assert together.progress.pointers.max() > 0


def test_members_that_are_left_out_keep_their_progress() -> None:
    controller = follower()
    controller.reset(2)
    controller.act(observed(np.zeros((2, 2))))
    controller.act(observed(np.array([[0.2, 0.0]])), np.array([1]))
    assert controller.progress.pointers.tolist() == [0, 4]
    assert controller.progress.stalled.tolist() == [0, 0]
    with pytest.raises(InvalidOption, match="call reset"):
        controller.act(observed(np.zeros((1, 2))))


def test_the_stall_counts_steps_without_progress() -> None:
    controller = follower()
    controller.reset(1)
    for expected in (0, 1, 2):
        controller.act(observed(np.zeros((1, 2))))
        assert controller.progress.stalled.tolist() == [expected]
    controller.act(observed(np.array([[0.1, 0.0]])))
    assert controller.progress.stalled.tolist() == [0]


def test_the_next_policy_acts_from_its_pointer_on() -> None:
    controller = follower(5.0, -5.0)
    controller.reset(2)
    for place in ([0.0, 0.0], [0.2, 0.0], [0.4, 0.0], [0.6, 0.0], [0.8, 0.0], [1.0, 0.0], [1.0, 0.2]):
        controller.act(observed(np.array([place, [0.0, 0.0]])))
    actions = controller.act(observed(np.array([[1.0, 0.25], [0.0, 0.0]])))
    assert controller.current.tolist() == [1, 0]
    assert actions[0, 1] < 0 < actions[1, 0]


def test_policies_have_to_fit_their_places() -> None:
    policy, actions = towards_the_line(1.0), ActionMap(LOW, HIGH, LOW.shape)
    for policies, firsts in (([], []), ([policy], [1]), ([policy], [0, 3]), ([policy, policy], [0, 0])):
        with pytest.raises(InvalidOption, match="in increasing order"):
            Follower(policies, firsts, LINE, VIEW, actions)
