"""Nearest neighbours are those of brute force, whatever the order of insertion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.planners.kernels import nearest


def fill(points):
    items, size = np.empty(len(points), np.int32), 0
    for item in range(len(points)):
        size = nearest.insert(points, items, size, item)
    return items, size


def squared(points, targets, found):
    return ((points[found] - targets) ** 2).sum(axis=1)


def check(points, targets):
    items, size = fill(points)
    found = np.empty(len(targets), np.int64)
    nearest.nearest(points, items, size, targets, found)
    best = ((points[None] - targets[:, None]) ** 2).sum(axis=2).min(axis=1)
    assert np.allclose(squared(points, targets, found), best, rtol=1e-12, atol=0)
    assert np.array_equal(np.sort(items), np.arange(len(points)))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 700), st.integers(1, 6), st.sampled_from([0, 1, 3]))
def test_equals_brute_force(seed, count, features, decimals):
    """Rounded coordinates make ties and duplicates."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 2, (count, features)).round(decimals)
    check(points, rng.uniform(-8, 8, (20, features)))


@pytest.mark.parametrize("points", [
    np.zeros((3000, 2)), np.arange(3000.0)[:, None], np.arange(3000.0)[::-1, None].copy(),
    np.arange(6000.0).reshape(3000, 2) ** 2,
], ids=["all equal", "rising", "falling", "on a curve"])
def test_no_order_degenerates_it(points):
    check(points, np.linspace(-10, 4000, 30)[:, None] * np.ones(points.shape[1]))


def test_random_walks_as_planners_make_them():
    rng = np.random.default_rng(0)
    check(np.cumsum(rng.normal(0, 0.1, (5000, 2)), axis=0), rng.uniform(-20, 20, (50, 2)))
