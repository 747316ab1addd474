"""States drawn near a state: inside the ball, valid, uniform, and the same for the same stream."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.sampling import uniform_in_ball

MODEL = make("pbcs/Maze-v0", {"size": 3})


@given(st.integers(0, 2**31), st.floats(0.0, 0.3), st.integers(0, 40))
@settings(max_examples=30, deadline=None)
def test_draws_are_near_and_valid(seed: int, radius: float, count: int) -> None:
    state = np.array([0.1, 0.9])
    drawn = MODEL.perturb(state, radius, count, np.random.default_rng(seed))
    assert drawn.shape == (count, 2)
    assert (MODEL.distance(drawn, state) <= radius * (1 + 1e-12) + 1e-15).all()
    assert MODEL.is_valid(drawn).all()
    np.testing.assert_array_equal(drawn, MODEL.perturb(state, radius, count, np.random.default_rng(seed)))


@pytest.mark.parametrize("dimensions", [1, 2, 5])
def test_the_ball_is_filled_uniformly(dimensions: int) -> None:
    points = uniform_in_ball(np.zeros(dimensions), 2.0, 20_000, np.random.default_rng(0))
    radii = np.linalg.norm(points, axis=1)
    for part in (0.25, 0.5, 0.75):
        assert (radii < 2.0 * part ** (1 / dimensions)).mean() == pytest.approx(part, abs=0.02)
    assert np.abs(points.mean(axis=0)).max() < 0.05


def test_without_rejection_some_draws_lie_in_walls() -> None:
    drawn = MODEL.perturb(np.array([0.1, 0.1]), 0.2, 500, np.random.default_rng(0), reject_invalid=False)
    assert 0.2 < MODEL.is_valid(drawn).mean() < 0.9
    after = MODEL.transition(drawn, np.full((500, 2), 0.01)).states  # total, also outside of the maze
    assert np.isfinite(after).all()


def test_no_valid_state_near() -> None:
    with pytest.raises(InvalidState, match=r"no valid state within 0\.01"):
        MODEL.perturb(np.array([0.5, 1.0]), 0.01, 3, np.random.default_rng(0))


def test_rollouts_from_earlier_states_find_what_leads_to_the_state() -> None:
    """A car that rolls to the left: random steps from a state lie to its left, those from before it on both sides."""
    car = make("MountainCarContinuous-v0")
    path = [car.initial_state(0)]
    for _ in range(15):
        path.append(car.transition(path[-1][None], np.array([[-1.0]])).states[0])
    states, place = np.array(path), lambda found: found[:, 0] - path[-1][0]
    passed = car.perturb(states[-1], 0.1, 50, np.random.default_rng(0))
    assert (place(passed) <= 0.0).all()
    counter = Counter()
    around = car.perturb(states[-1], 0.1, 50, np.random.default_rng(0), before=states[10:15], counter=counter)
    assert (place(around) > 0.0).mean() > 0.2
    assert (place(around) < 0.0).any()
    assert (car.distance(around, states[-1]) <= 0.1).all()
    assert 50 < counter.count < 2000


def test_a_ball_that_rollouts_leave_is_answered_by_a_radius_that_holds_them() -> None:
    """Random torques move the arm further than 0.01 in a step or two, from the state and from those before it."""
    arm = make("Reacher-v5")
    states = [arm.initial_state(0)]
    for _ in range(12):
        states.append(arm.transition(states[-1][None], arm.action_high[None]).states[0])
    before, rng = np.array(states[:-1]), np.random.default_rng(0)
    refused = r"leave the ball of radius 0\.01 .*expected 20; 10% .*\"radius\": "
    with pytest.raises(InvalidState, match=refused) as refusal:
        arm.perturb(states[-1], 0.01, 20, rng, before=before)
    proposed = float(str(refusal.value).split('"radius": ')[1].split("}")[0])
    assert len(arm.perturb(states[-1], proposed, 20, rng, before=before)) == 20


@pytest.mark.parametrize("radius", [-0.1, float("nan"), float("inf")])
def test_radii_out_of_range(radius: float) -> None:
    with pytest.raises(InvalidOption, match="radius"):
        MODEL.perturb(np.array([0.5, 0.5]), radius, 1, np.random.default_rng(0))
