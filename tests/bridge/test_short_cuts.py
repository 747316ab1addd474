"""Short cuts of plans: free motion is recognised, cells are as what is nearest, the kernel is the plain rule."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.bridge.free_motion import FreeMotion
from pbcs_ompl.bridge.free_space import CAUTION, FreeSpace
from pbcs_ompl.bridge.kernels.sight import SAMPLES, shortest_way


def transitions(world, rng, count=400):
    """Return random transitions of a world in NumPy."""
    states = rng.uniform(0.0, 5.0, (count, 2))
    controls = rng.uniform(world.action_low, world.action_high, (count, 2))
    return states, controls, world.transition(states, controls).states


def test_free_motion_is_found_among_blocked_transitions_and_leads_exactly_to_a_state_nearby(square):
    rng, world = np.random.default_rng(0), square()
    states, controls, after = transitions(world, rng)
    blocked = np.abs(after - states - controls).max(axis=1) > 1e-12  # by the wall, or by the border
    assert 20 < blocked.sum() < 200
    motion = FreeMotion.shown_by(world, states, controls, after)
    assert motion is not None
    assert np.array_equal(motion.gain, np.eye(2))
    assert np.array_equal(motion.is_free(states, controls, after), ~blocked)
    here = rng.uniform(3.5, 4.5, (300, 2))
    there = np.clip(here + rng.uniform(-0.85, 0.85, (300, 2)), 2.5, 4.9)
    for left in (3, 2, 1):
        here = world.transition(here, motion.controls(here, there, np.full(300, left))).states
    assert np.array_equal(here, there)


def test_gain_and_drift_of_other_bounds(square):
    rng, world = np.random.default_rng(1), square()
    world.action_low, world.action_high = np.array([-1.0, -0.5]), np.array([2.0, 3.0])
    gain, shift = np.array([[0.5, 0.1], [0.0, -0.25]]), np.array([0.01, -0.02])
    states, controls = rng.uniform(-9, 9, (200, 2)), rng.uniform(world.action_low, world.action_high, (200, 2))
    motion = FreeMotion.shown_by(world, states, controls, states + controls @ gain + shift)
    assert motion is not None
    np.testing.assert_allclose(motion.gain, gain, atol=1e-12)
    chosen = motion.controls(states, states + 0.05, np.ones(200))
    assert ((chosen >= world.action_low) & (chosen <= world.action_high)).all()
    np.testing.assert_allclose(states + chosen @ gain + shift, states + 0.05, atol=1e-9)
    moved = motion.in_steps(states + controls @ gain + shift) - motion.in_steps(states)
    assert (moved >= motion.low - 1e-9).all()
    assert (moved <= motion.high + 1e-9).all()


def test_other_dynamics_are_not_taken_for_free_motion(square):
    """A double integrator has more dimensions than controls; a turned control is no function of the control alone."""
    rng, world = np.random.default_rng(2), square()
    states, controls = rng.uniform(-1, 1, (300, 4)), rng.uniform(-0.1, 0.1, (300, 2))
    assert FreeMotion.shown_by(world, states, controls, states + 0.1) is None
    states = rng.uniform(-1, 1, (300, 2))
    turned = np.stack([np.cos(states[:, 0]) * controls[:, 0], np.sin(states[:, 1]) + controls[:, 1]], axis=1)
    assert FreeMotion.shown_by(world, states, controls, states + turned) is None
    assert FreeMotion.shown_by(world, states[:3], controls[:3], states[:3] + controls[:3]) is None


def test_a_short_cut_keeps_off_what_was_blocked(square):
    """In a world without walls the first and the last state see each other; with a wall between them they do not."""
    world = square()
    motion = FreeMotion.shown_by(world, *transitions(world, np.random.default_rng(3)))
    assert motion is not None
    there = np.arange(11)
    plan = 1.0 + 0.29 * np.array([*((k, 0) for k in there), *((10, k) for k in there[1:]),
                                  *((10 - k, 10) for k in there[1:])])
    steps, index = np.diff(plan, axis=0), np.arange(len(plan))
    open_space = FreeSpace(motion, plan[:-1], steps, plan[1:])
    assert open_space.short_cuts(plan, index) == [(0, 30, 10)]
    bumps = np.array([(x, 2.35) for x in np.arange(0.1, 3.1, 0.3)])  # a wall above y = 2.35 up to x = 2.8
    wall = FreeSpace(motion, np.vstack([plan[:-1], bumps]), np.vstack([steps, np.full((10, 2), (0.0, 0.3))]),
                     np.vstack([plan[1:], bumps]))
    cuts = wall.short_cuts(plan, index)
    assert cuts
    for cut in cuts:
        assert cut.steps < cut.last - cut.first
        (x0, y0), (x1, y1) = plan[cut.first], plan[cut.last]
        if y0 < 2.5 < y1:
            assert x0 + (x1 - x0) * (2.5 - y0) / (y1 - y0) > 2.8
    likely = wall._likely_blocked()
    free, hit = np.argwhere(wall._free), np.argwhere(wall._blocked & ~wall._free)
    for cell in np.random.default_rng(4).integers(0, likely.shape, (200, 2)):
        nearest = [np.abs(seen - cell).max(axis=1).min() for seen in (free, hit)]
        assert likely[tuple(cell)] == (nearest[1] < CAUTION * nearest[0])


def plainly(points, index, low, high, most, blocked):
    """Return the length of the shortest way, by all pairs."""
    length = np.full(len(index), np.inf)
    length[0] = 0.0
    for j in range(1, len(index)):
        length[j] = length[j - 1] + index[j] - index[j - 1]
        for i in range(j):
            way = points[j] - points[i]
            steps = max(1, int(np.ceil(np.maximum(way / high, way / low).max() + 1e-9)))
            count = int(SAMPLES * np.abs(way).max()) + 1
            line = points[i] + (np.arange(count)[:, None] + 0.5) / count * way
            if steps <= most and steps < index[j] - index[i] and not blocked[tuple(line.astype(int).T)].any():
                length[j] = min(length[j], length[i] + steps)
    return length[-1]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 3]), st.sampled_from([5, 60]))
def test_the_kernel_finds_the_shortest_way(seed, axes, most):
    rng = np.random.default_rng(seed)
    shape = np.full(axes, 9)
    points, index = rng.uniform(0.0, 9.0, (15, axes)), np.cumsum(rng.integers(1, 12, 15)) - 1
    low, high, blocked = -rng.uniform(0.5, 2.0, axes), rng.uniform(0.5, 2.0, axes), rng.random(shape) < 0.1
    before, straight = shortest_way(points, index, low, high, most, blocked.ravel(), shape)
    at, total = len(index) - 1, 0
    while at > 0:
        total += straight[at] or index[at] - index[before[at]]
        at = before[at]
    assert total == plainly(points, index, low, high, most, blocked)
